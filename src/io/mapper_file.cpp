#include "bki_mapping/io/mapper_file.h"

#include <filesystem>

#include "bki_mapping/io/config_yaml.h"

namespace bki_mapping {

bool isMapFileName(const std::string& path) {
  return std::filesystem::path(path).extension() == ".bkm";
}

MapInfo mapInfoOf(const SemanticMapper& mapper, const std::string& frame) {
  MapInfo info;
  info.resolution = mapper.map().geometry().resolution();
  info.prior = mapper.map().prior();
  info.frame = frame;
  info.classes = mapper.sharedClasses();
  info.parameters = parameterYaml(mapper.config());
  return info;
}

StoredMap loadMapFor(const SemanticMapper& mapper, const std::string& path, const std::string& frame) {
  MapFile file(path, MapFile::Access::kRead);
  checkFits(file, mapInfoOf(mapper, frame));
  return readMap(file, static_cast<std::size_t>(1e6 * mapper.config().memory_limit));
}

}  // namespace bki_mapping
