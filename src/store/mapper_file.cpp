#include "bki_mapping/store/mapper_file.h"

#include <filesystem>
#include <map>
#include <stdexcept>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/settings/yaml.h"
#include "core/frame_name.h"

namespace bki_mapping {
namespace {

/// Whether the parameters are those of a map made before there was rules/enabled, with a preset that counted
/// scans: hits of one added 0.02, as much as RulesConfig's but for 3 %.
bool countedScansBefore(const std::map<std::string, std::string>& values) {
  const auto hits = values.find("scan_limit/hits");
  return hits != values.end() && hits->second == "0.02";
}

}  // namespace

bool isMapFileName(const std::string& path) {
  return std::filesystem::path(path).extension() == ".bkm";
}

MapInfo mapInfoOf(const SemanticMapper& mapper, const std::string& frame) {
  MapInfo info;
  info.resolution = mapper.map().geometry().resolution();
  info.prior = mapper.map().prior();
  info.frame = frameName(frame);
  info.classes = mapper.sharedClasses();
  info.parameters = parameterYaml(mapper.config());
  return info;
}

StoredMap loadMapFor(const SemanticMapper& mapper, const std::string& path, const std::string& frame) {
  MapFile file(path, MapFile::Access::kRead);
  checkFits(file, mapInfoOf(mapper, frame));
  return readMap(file, static_cast<std::size_t>(1e6 * mapper.config().memory_limit));
}

StateRules storedRules(const std::string& path, const MapInfo& info) {
  MapperConfig config;
  try {
    const std::map<std::string, std::string> values = parseParameters(info.parameters);
    std::map<std::string, std::string> rules;
    for (const Parameter& parameter : mapperParameters()) {
      const auto found = values.find(parameter.name);
      if (found != values.end() && parameter.name.rfind("rules/", 0) == 0) rules.insert(*found);
    }
    setParameters(config, rules);
    checkParameters(config);
    if (countedScansBefore(values)) config.rules.enabled = true;
    return StateRules(config.rules, *info.classes, info.resolution);
  } catch (const std::invalid_argument& error) {
    throw MapFileError("the parameters in " + path + " cannot be used: " + error.what());
  }
}

RuledMap loadRuledMap(const std::string& path) {
  MapFile file(path, MapFile::Access::kRead);
  RuledMap stored{{file.info(), file.drives(), file.info().emptyMap()}, storedRules(path, file.info())};
  for (const TileEntry& tile : file.tiles()) file.addTileTo(stored.map, {tile.index});
  return stored;
}

}  // namespace bki_mapping
