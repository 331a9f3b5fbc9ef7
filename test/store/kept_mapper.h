/// @file A mapper whose map is kept in a file, and what the map should be.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "bki_mapping/store/map_keeper.h"
#include "reference/content.h"
#include "reference/scenes.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {

constexpr double kWindow = 60.0;  ///< [m]; the scans reach 25 m

inline MapperConfig configOf(const std::string& mode = "line", double memory_limit = 0.0) {
  MapperConfig config;
  config.resolution = 0.5;
  config.free_space.mode = mode;
  config.free_space.extent = FreeSpaceExtent::kObserved;
  config.memory_limit = memory_limit;
  config.threads = 2;
  return config;
}

/// A scan of a sensor at a place [m].
inline Scan scanAt(double x, double y, std::uint64_t stamp) {
  std::mt19937_64 random(stamp);
  std::uniform_real_distribution<double> angle(-3.1, 3.1), range(2.0, 25.0), height(-2.0, 2.0);
  Scan scan;
  scan.stamp = stamp;
  scan.origin = {x, y, 0.3};
  for (int p = 0; p < 150; ++p) {
    const double a = angle(random), r = range(random);
    scan.points.push_back(Eigen::Vector3d(r * std::cos(a), r * std::sin(a), height(random)).cast<float>());
    scan.labels.push_back(10u * (1 + p % 2));
  }
  return scan;
}

/// Out, round a loop, and back over the same ground.
inline std::vector<Scan> drive() {
  std::vector<Scan> scans;
  const auto add = [&](double x, double y) { scans.push_back(scanAt(x, y, scans.size() + 1)); };
  for (double x = 0.0; x < 200.0; x += 4.0) add(x, 0.0);
  for (double y = 0.0; y < 120.0; y += 4.0) add(200.0, y);
  for (double y = 120.0; y > 0.0; y -= 4.0) add(200.0 - y / 4.0, y);
  for (double x = 200.0; x > -20.0; x -= 4.0) add(x, 1.0);
  return scans;
}

inline MapInfo infoOfMapper(const SemanticMapper& mapper) {
  MapInfo info = infoOf();
  info.resolution = mapper.map().geometry().resolution();
  info.prior = mapper.map().prior();
  info.classes = mapper.sharedClasses();
  return info;
}

inline DriveRecord newDrive(const std::string& id) {
  DriveRecord drive;
  drive.id = id;
  return drive;
}

/// A mapper whose map is kept in a file.
struct Kept {
  Kept(const std::string& path, const std::string& id, const MapperConfig& config = configOf())
      : mapper(config, reference::smallTable()), keeper(mapper, path, infoOfMapper(mapper), newDrive(id)) {}

  void integrate(const Scan& scan, double window = kWindow) {
    mapper.integrate(scan);
    keeper.addScan(scan.stamp);
    keeper.moveTo({scan.origin, window});
    most_bytes = std::max(most_bytes, mapper.mapBytes());
  }

  SemanticMapper mapper;
  MapKeeper keeper;
  std::size_t most_bytes = 0;
};

inline std::map<GridIndex, std::string> contentOfAll(const std::vector<Scan>& scans,
                                                     const MapperConfig& config = configOf()) {
  SemanticMapper mapper(config, reference::smallTable());
  for (const Scan& scan : scans) mapper.integrate(scan);
  return reference::contentOf(mapper.map());
}

inline std::map<GridIndex, std::string> contentIn(const std::string& path) {
  return reference::contentOf(loadMap(path).map);
}

/// Equality, without megabytes of print where it fails.
inline testing::AssertionResult same(const std::map<GridIndex, std::string>& a,
                                     const std::map<GridIndex, std::string>& b) {
  std::size_t missing = 0, different = 0, more = a.size();
  for (const auto& [index, content] : b) {
    const auto other = a.find(index);
    missing += other == a.end();
    more -= other != a.end();
    different += other != a.end() && other->second != content;
  }
  if (missing + different + more == 0) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "of " << b.size() << " blocks " << missing << " are missing, "
                                     << different << " different, and " << more << " too many";
}

/// Flips a bit in the middle of a map file, where there is the content of a tile. @return the tiles that
/// cannot be read then.
inline std::vector<GridIndex> damageATile(const std::string& path) {
  std::string bytes;
  {
    std::ifstream file(path, std::ios::binary);
    bytes.assign(std::istreambuf_iterator<char>(file), {});
  }
  constexpr std::size_t kPage = 4096;
  const std::size_t middle = bytes.size() / (2 * kPage) * kPage + kPage / 2;
  bytes[middle] = static_cast<char>(bytes[middle] ^ 0x10);
  std::ofstream(path, std::ios::binary) << bytes;
  std::vector<GridIndex> damaged;
  MapFile file(path, MapFile::Access::kRead);
  SemanticMap ignored = file.info().emptyMap();
  for (const TileEntry& tile : file.tiles()) {
    try {
      file.addTileTo(ignored, {tile.index});
    } catch (const MapFileDamaged&) {
      damaged.push_back(tile.index);
    }
  }
  return damaged;
}

}  // namespace bki_mapping
