/// @file How services answer what went wrong.
#pragma once

#include <exception>
#include <new>
#include <string>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_interface {

/// Answers what `make` returns, or the sentence that it throws.
template <typename Response, typename Make>
void answer(Response& response, Make&& make) {
  constexpr std::size_t kLongest = 1000;  // bytes: sentences quote what the client has sent
  try {
    response.message = make();
    response.success = true;
  } catch (const std::bad_alloc&) {
    response.success = false;
    response.message = "the computer's memory does not suffice; free some, or use a smaller map";
  } catch (const std::exception& fault) {
    response.success = false;
    response.message = fault.what();
  }
  response.message = shortText(response.message, kLongest);
}

}  // namespace bki_mapping::ros_interface
