#include "bki_mapping/io/mapper_file.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

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

void DriveLog::addScan(std::uint64_t stamp, const SemanticMapper& mapper) {
  record_.first_stamp = record_.scans == 0 ? stamp : std::min(record_.first_stamp, stamp);
  record_.last_stamp = std::max(record_.last_stamp, stamp);
  ++record_.scans;
  const GridGeometry& geometry = mapper.map().geometry();
  for (const GridIndex& block : mapper.touchedBlocks()) {
    const Eigen::Vector3d low = geometry.blockOrigin({block});
    record_.bounds.extend(low);
    record_.bounds.extend(low + Eigen::Vector3d::Constant(geometry.blockSize()));
  }
}

StoredMap loadMapFor(const SemanticMapper& mapper, const std::string& path, const std::string& frame) {
  MapFile file(path, MapFile::Access::kRead);
  const MapInfo own = mapInfoOf(mapper, frame);
  if (!frame.empty() && file.info().frame != frame) {
    throw MapFileError("the map in " + path + " is in frame '" + file.info().frame +
                       "', and the mapper maps in '" + frame + "'; set frame_id to the frame of the map");
  }
  try {
    checkSameGrid(path, file.info(), "the mapper", own);
  } catch (const std::invalid_argument& difference) {
    throw MapFileError(difference.what());
  }
  return readMap(file, static_cast<std::size_t>(1e6 * mapper.config().memory_limit));
}

void addDrives(std::vector<DriveRecord>& drives, const std::vector<DriveRecord>& others) {
  for (const DriveRecord& other : others) {
    if (std::any_of(drives.begin(), drives.end(), [&](const DriveRecord& d) { return d.id == other.id; })) {
      throw std::invalid_argument("drive '" + other.id + "' is in the map already");
    }
    drives.push_back(other);
  }
}

}  // namespace bki_mapping
