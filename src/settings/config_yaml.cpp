#include "bki_mapping/settings/yaml.h"

#include <sstream>
#include <stdexcept>

#include "bki_mapping/mapping/mapper_config.h"
#include "settings/named_file.h"
#include "settings/yaml_file.h"

namespace bki_mapping {
namespace {

/// The text of a scalar. The truth words of YAML 1.1, which roslaunch reads as such, become "true" and
/// "false".
std::string textOf(const YAML::Node& scalar) {
  const std::string text = scalar.as<std::string>();
  const bool is_quoted = scalar.Tag() == "!";
  if (is_quoted) return text;
  for (const char* word : {"true", "True", "TRUE", "yes", "Yes", "YES", "on", "On", "ON"}) {
    if (text == word) return "true";
  }
  for (const char* word : {"false", "False", "FALSE", "no", "No", "NO", "off", "Off", "OFF"}) {
    if (text == word) return "false";
  }
  return text;
}

void flatten(const YAML::Node& node, const std::string& name, std::map<std::string, std::string>& values) {
  if (node.IsMap()) {
    for (const auto& entry : node) {
      flatten(entry.second, (name.empty() ? "" : name + "/") + entry.first.as<std::string>(), values);
    }
  } else if (name.empty() && !node.IsNull()) {
    throw std::invalid_argument("it must be a map of parameters, as 'resolution: 0.2' is");
  } else if (node.IsScalar()) {
    if (!values.emplace(name, textOf(node)).second) {
      throw std::invalid_argument("parameter '" + name + "' is given twice; keep one");
    }
  } else if (!(node.IsNull() && name.empty())) {  // an empty file sets nothing
    throw std::invalid_argument("parameter '" + name + "' must have one value");
  }
}

/// Wraps a sentence into comment lines of at most 100 characters.
std::string comment(const std::string& sentence, const std::string& indent) {
  std::istringstream words(sentence);
  std::string text, line = indent + "#";
  for (std::string word; words >> word;) {
    if (line.size() + 1 + word.size() > 100) {
      text += line + "\n";
      line = indent + "#";
    }
    line += " " + word;
  }
  return text + line + "\n";
}

}  // namespace

std::map<std::string, std::string> loadParameterFile(const std::string& name_or_file) {
  const std::string file = findNamedFile("parameter file", "config/presets", name_or_file);
  std::map<std::string, std::string> values;
  try {
    flatten(loadYamlFile(file), "", values);
  } catch (const std::exception& error) {
    throw std::invalid_argument("parameter file " + file + ": " + error.what());
  }
  return values;
}

std::map<std::string, std::string> parseParameters(const std::string& yaml) {
  std::map<std::string, std::string> values;
  try {
    flatten(parseYaml(yaml), "", values);
  } catch (const YAML::Exception& error) {
    throw std::invalid_argument(error.what());
  }
  return values;
}

std::string parameterYaml(const MapperConfig& config) {
  std::string text, group;
  for (const Parameter& p : mapperParameters()) {
    const std::size_t slash = p.name.find('/');
    const std::string new_group = slash == std::string::npos ? "" : p.name.substr(0, slash);
    if (new_group != group && !new_group.empty()) text += new_group + ":\n";
    group = new_group;
    const std::string indent = group.empty() ? "" : "  ";
    const std::string unit = p.unit.empty() ? "" : " [" + p.unit + "]";
    text += comment(p.description, indent) + comment(p.values + unit, indent);
    text += indent + (group.empty() ? p.name : p.name.substr(slash + 1)) + ": " + p.get(config) + "\n";
  }
  return text;
}

}  // namespace bki_mapping
