#include "bki_mapping/settings/yaml.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <stdexcept>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "settings/named_file.h"
#include "settings/yaml_file.h"

namespace bki_mapping {
namespace {

/// Of the package's tables, relative to sharePath().
constexpr char kClassFolder[] = "config/classes";

[[noreturn]] void fail(const std::string& file, const std::string& why) {
  throw std::invalid_argument("class table " + file + ": " + why);
}

void setFlag(const std::string& file, const std::string& flag, SemanticClass& c) {
  if (flag == "unlabelled") {
    c.unlabelled = true;
  } else if (flag == "dynamic") {
    c.dynamic = true;
  } else if (flag == "living") {
    c.dynamic = c.living = true;
  } else if (flag == "ground") {
    c.ground = true;
  } else if (flag == "ignored") {
    c.ignored = true;
  } else if (flag == "airborne") {
    c.airborne = true;
  } else {
    fail(file, "flag '" + flag + "' is unknown" +
                   nearestWord(flag, {"unlabelled", "dynamic", "living", "ground", "ignored", "airborne"}));
  }
}

std::uint8_t byteOf(const std::string& file, const YAML::Node& node, const std::string& what) {
  const int value = node.as<int>();
  if (value < 0 || value > 255) fail(file, what + " " + std::to_string(value) + " is not in 0 to 255");
  return static_cast<std::uint8_t>(value);
}

/// A number of 32 bits; read as a signed one: to yaml-cpp 0.6, -1 is a large unsigned one.
/// @param owner what it belongs to, for the message.
std::uint32_t numberOf(const std::string& file, const YAML::Node& node, const std::string& what,
                       const std::string& owner, std::int64_t least) {
  constexpr auto kLargest = std::numeric_limits<std::uint32_t>::max();
  const auto value = node.as<std::int64_t>();
  if (value < least || value > kLargest) {
    fail(file, what + " " + std::to_string(value) + " of " + owner + " is not in " + std::to_string(least) +
                   " to " + std::to_string(kLargest));
  }
  return static_cast<std::uint32_t>(value);
}

/// @param owner what the keys belong to, for the message.
void checkKeys(const std::string& file, const YAML::Node& map, const std::string& owner,
               const std::vector<std::string>& known) {
  for (const auto& entry : map) {
    const auto key = entry.first.as<std::string>();
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      fail(file, "key '" + key + "' of " + owner + " is unknown" + nearestWord(key, known));
    }
  }
}

/// @param owner what the name belongs to, for the message.
std::string nameOf(const std::string& file, const YAML::Node& node, const std::string& owner) {
  const std::string name = node.IsNull() ? "" : node.as<std::string>();
  if (name.empty()) fail(file, "the name of " + owner + " is empty");
  return name;
}

/// @param number position of the class in the list, counted from 1.
SemanticClass parseClass(const std::string& file, const YAML::Node& node, std::size_t number) {
  if (!node.IsMap()) fail(file, "class " + std::to_string(number) + " of the list is not a map");
  checkKeys(file, node, "a class", {"id", "name", "color", "raw", "flags", "free_gain", "cost"});
  for (const char* key : {"id", "name", "color"}) {
    if (!node[key]) fail(file, std::string("a class has no '") + key + "'");
  }
  SemanticClass c;
  c.id = byteOf(file, node["id"], "id");
  c.name = nameOf(file, node["name"], "class " + std::to_string(c.id));
  if (!node["color"].IsSequence() || node["color"].size() != 3)
    fail(file, "the color of class '" + c.name + "' is not [red, green, blue]");
  for (std::size_t i = 0; i < 3; ++i) c.color[i] = byteOf(file, node["color"][i], "color");
  if (!node["raw"]) {
    c.raw = {c.id};
  } else if (node["raw"].IsScalar() && node["raw"].as<std::string>() == "any") {
    c.any_raw = true;
  } else if (!node["raw"].IsSequence()) {
    fail(file, "raw of class '" + c.name + "' must be a list of numbers, or any");
  } else {
    for (const YAML::Node& each : node["raw"]) {
      c.raw.push_back(numberOf(file, each, "raw label", "class '" + c.name + "'", -1));
    }
  }
  const YAML::Node flags = node["flags"];
  if (flags && !flags.IsSequence()) {
    fail(file, "the flags of class '" + c.name + "' must be a list; write [" +
                   (flags.IsScalar() ? flags.as<std::string>() : "dynamic") + "]");
  }
  for (const YAML::Node& flag : flags) setFlag(file, flag.as<std::string>(), c);
  if (c.ground && c.ignored) fail(file, "class '" + c.name + "' is flagged both ground and ignored");
  if (c.ground && c.airborne) fail(file, "class '" + c.name + "' is flagged both ground and airborne");
  if (node["free_gain"]) {
    c.free_gain = node["free_gain"].as<double>();
    if (!(*c.free_gain > 0.0 && std::isfinite(*c.free_gain)))
      fail(file, "the free_gain of class '" + c.name + "' must be a number > 0");
  }
  if (node["cost"] && !YAML::convert<int>::decode(node["cost"], c.cost))
    fail(file, "the cost of class '" + c.name + "' must be a whole number from 0 to 100");
  return c;
}

}  // namespace

std::vector<std::string> classTableNames() {
  return namedFiles(kClassFolder);
}

std::string classTableFile(const std::string& name_or_file) {
  return findNamedFile("class table", kClassFolder, name_or_file);
}

ClassTable loadClassTable(const std::string& name_or_file) {
  const std::string file = classTableFile(name_or_file);
  try {
    const YAML::Node root = loadYamlFile(file);
    if (!root.IsMap()) fail(file, "it must be a map with a list 'classes'");
    checkKeys(file, root, "the table", {"name", "label_mask", "classes"});
    if (!root["classes"] || !root["classes"].IsSequence()) fail(file, "it has no list 'classes'");
    const YAML::Node mask = root["label_mask"];
    const std::uint32_t label_mask =
        mask ? numberOf(file, mask, "label_mask", "the table", 1) : ClassTable::kAllBits;
    std::vector<SemanticClass> classes;
    for (const YAML::Node& node : root["classes"]) {
      classes.push_back(parseClass(file, node, classes.size() + 1));
    }
    return ClassTable(
        root["name"] ? nameOf(file, root["name"], "the table") : std::filesystem::path(file).stem().string(),
        classes, label_mask);
  } catch (const YAML::Exception& error) {
    fail(file, error.what());
  }
}

}  // namespace bki_mapping
