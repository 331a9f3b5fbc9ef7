/// @file YAML files that others wrote.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace bki_mapping {

/// Reads a YAML file of one document. What would take the memory, the stack or the time of whoever walks
/// through it is refused before any node is made: more than 1 MB, more than 32 levels, more than 100,000
/// nodes with all aliases followed, an alias to a node that it is in; so are keys that are no plain text, or
/// twice in a map.
/// @throws YAML::Exception in one sentence, which leaves it to the caller to name the file.
YAML::Node loadYamlFile(const std::string& path);

}  // namespace bki_mapping
