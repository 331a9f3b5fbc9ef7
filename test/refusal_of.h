/// @file The sentences with which calls refuse.
#pragma once

#include <stdexcept>
#include <string>

namespace bki_mapping {

/// The sentence of the Error that a call throws; "" if it throws nothing.
template <typename Error = std::invalid_argument, typename Call>
std::string refusalOf(Call&& call) {
  try {
    call();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace bki_mapping
