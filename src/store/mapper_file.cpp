#include "bki_mapping/store/mapper_file.h"

#include <filesystem>
#include <map>
#include <stdexcept>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/settings/yaml.h"
#include "core/frame_name.h"

namespace bki_mapping {

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
    std::map<std::string, std::string> gains;
    for (const Parameter& parameter : mapperParameters()) {
      const auto found = values.find(parameter.name);
      if (found != values.end() && parameter.name.rfind("free_gain/", 0) == 0) gains.insert(*found);
    }
    setParameters(config, gains);
    config.resolution = info.resolution;
    config.prior = info.prior;
    checkParameters(config);
    return StateRules(config.free_gain, *info.classes);
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
