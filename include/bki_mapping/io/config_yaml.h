/// @file Parameters from YAML files.
#pragma once

#include <map>
#include <string>

namespace bki_mapping {

/// Reads a YAML file of nested maps as names with `/` between the parts, and values as text.
/// @throws std::invalid_argument in one sentence: no such file, bad YAML, a value that is a list.
std::map<std::string, std::string> loadParameterFile(const std::string& file);

}  // namespace bki_mapping
