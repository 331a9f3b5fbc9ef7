/// @file Parameters that earlier versions had.
#pragma once

#include <map>
#include <string>

namespace bki_mapping {

/// @throws std::invalid_argument if any of the names is that of a parameter of an earlier version, with what
/// to set instead.
void refuseFormerParameters(const std::map<std::string, std::string>& values);

}  // namespace bki_mapping
