#include "journal/stored_settings.h"

#include <zlib.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/settings/yaml.h"

namespace bki_mapping {
namespace {

constexpr char kAirborne[] = "class_table/airborne", kDigest[] = "class_table/digest";

using Values = std::map<std::string, std::string>;

Values valuesOf(const std::string& yaml, const std::string& file) {
  try {
    return parseParameters(yaml);
  } catch (const std::invalid_argument& error) {
    throw MapFileError("the settings in the journal of " + file + " cannot be used: " + error.what());
  }
}

std::shared_ptr<const MapperConfig> configOf(const Values& values, const std::string& file) {
  auto config = std::make_shared<MapperConfig>();
  Values known = values;
  for (const char* const of_classes : {kAirborne, kDigest}) known.erase(of_classes);
  try {
    setParameters(*config, known);
    checkParameters(*config);
  } catch (const std::invalid_argument& error) {
    throw MapFileError("the settings in the journal of " + file + " cannot be used: " + error.what());
  }
  return config;
}

/// The ids of the classes with the flag airborne, separated by spaces.
std::string airborneOf(const ClassTable& classes) {
  std::string ids;
  for (const SemanticClass& c : classes.classes()) {
    if (c.airborne) ids += (ids.empty() ? "" : " ") + std::to_string(c.id);
  }
  return ids;
}

/// A checksum of what of a class table decides the evidence of a scan.
std::string digestOf(const ClassTable& classes) {
  std::ostringstream text;
  text << classes.labelMask();
  for (const SemanticClass& c : classes.classes()) {
    text << "\n" << int{c.id} << c.any_raw << c.unlabelled << c.dynamic << c.living << c.ground << c.airborne;
    text << (c.free_gain ? numberText(*c.free_gain) : "");
    for (const std::uint32_t raw : c.raw) text << " " << raw;
  }
  const std::string bytes = text.str();
  return std::to_string(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::shared_ptr<const ClassTable> withAirborne(const ClassTable& classes, const std::string& ids) {
  std::set<int> airborne;
  std::istringstream words(ids);
  for (int id = 0; words >> id;) airborne.insert(id);
  std::vector<SemanticClass> flagged = classes.classes();
  for (SemanticClass& c : flagged) c.airborne = airborne.count(c.id) > 0;
  return std::make_shared<const ClassTable>(classes.name(), flagged, classes.labelMask());
}

}  // namespace

std::string settingsText(const MapperConfig& config, const ClassTable& classes) {
  return parameterYaml(config) + "\nclass_table:\n  airborne: \"" + airborneOf(classes) +
         "\"\n  digest: " + digestOf(classes) + "\n";
}

std::vector<std::shared_ptr<const MapperConfig>> journalSettings(MapFile& file) {
  std::vector<std::shared_ptr<const MapperConfig>> settings;
  for (const std::string& yaml : file.settings()) {
    settings.push_back(configOf(valuesOf(yaml, file.path()), file.path()));
    if (settings.back()->resolution == file.info().resolution) continue;
    throw MapFileError("the settings in the journal of " + file.path() + " cannot be used: resolution is " +
                       numberText(settings.back()->resolution) + ", and that of the map " +
                       numberText(file.info().resolution));
  }
  return settings;
}

std::shared_ptr<const ClassTable> journalClasses(MapFile& file) {
  std::shared_ptr<const ClassTable> classes = file.info().classes;
  std::optional<std::string> airborne;
  std::set<std::string> digests;
  const std::vector<std::string> settings = file.settings();
  std::set<int> used;
  for (const ScanRecord& scan : file.scans()) used.insert(scan.settings);
  for (const int number : used) {
    const Values values = valuesOf(settings[static_cast<std::size_t>(number)], file.path());
    const auto digest = values.find(kDigest), ids = values.find(kAirborne);
    if (digest == values.end() || ids == values.end()) continue;
    airborne = ids->second;
    digests.insert(digest->second);
  }
  if (airborne) classes = withAirborne(*classes, *airborne);
  if (digests.empty() || digests == std::set<std::string>{digestOf(*classes)}) return classes;
  throw MapFileError(
      "scans in the journal of " + file.path() +
      " were mapped with a class table that has other labels or flags than that of the file, so that they "
      "cannot be moved; map them again with one class table");
}

}  // namespace bki_mapping
