#include "bki_mapping/io/config_yaml.h"

#include <yaml-cpp/yaml.h>

#include <stdexcept>

namespace bki_mapping {
namespace {

void flatten(const YAML::Node& node, const std::string& name, std::map<std::string, std::string>& values) {
  if (node.IsMap()) {
    for (const auto& entry : node) {
      flatten(entry.second, (name.empty() ? "" : name + "/") + entry.first.as<std::string>(), values);
    }
  } else if (node.IsScalar()) {
    values[name] = node.as<std::string>();
  } else if (!(node.IsNull() && name.empty())) {  // an empty file sets nothing
    throw std::invalid_argument("parameter '" + name + "' must have one value");
  }
}

}  // namespace

std::map<std::string, std::string> loadParameterFile(const std::string& file) {
  std::map<std::string, std::string> values;
  try {
    flatten(YAML::LoadFile(file), "", values);
  } catch (const YAML::BadFile&) {
    throw std::invalid_argument("parameter file " + file + " cannot be read; check the path");
  } catch (const std::exception& error) {
    throw std::invalid_argument("parameter file " + file + ": " + error.what());
  }
  return values;
}

}  // namespace bki_mapping
