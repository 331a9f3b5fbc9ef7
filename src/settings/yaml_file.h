/// @file Reads untrusted YAML files.
#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace bki_mapping {

/// Reads a YAML file of one document. Limits protect memory, stack and time of the program, and are checked
/// before any node is created: 1 MB, 32 levels, 100,000 nodes with all aliases expanded, no alias to a node
/// that contains it. Every key must be plain text and unique in its map.
/// @throws YAML::Exception in one sentence, to which the caller adds the name of the file.
YAML::Node loadYamlFile(const std::string& path);
/// The same of a text, without its own limit on the size.
YAML::Node parseYaml(const std::string& text);

}  // namespace bki_mapping
