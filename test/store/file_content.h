/// @file All that a map file says, to be compared.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"
#include "reference/content.h"

namespace bki_mapping {

struct FileContent {
  std::string info;  ///< the rows of the tables `map` and `class`
  std::vector<DriveRecord> drives;
  std::map<int, std::map<GridIndex, std::string>> parts;  ///< as reference::contentOf
  std::string journal;

  bool operator==(const FileContent& other) const {
    return info == other.info && drives == other.drives && parts == other.parts && journal == other.journal;
  }
};

inline std::string textOf(const MapInfo& info) {
  std::ostringstream text;
  text.precision(17);
  text << info.resolution << '|' << info.prior << '|' << info.unit_exponent << '|' << info.frame << '|'
       << info.parameters << '|' << info.program << '|' << info.classes->name();
  for (const SemanticClass& c : info.classes->classes()) {
    text << '\n'
         << int{c.id} << '|' << c.name << '|' << c.any_raw << c.unlabelled << c.dynamic << c.living
         << c.ground << c.ignored;
    for (const int channel : c.color) text << '|' << channel;
    for (const std::uint32_t raw : c.raw) text << '|' << raw;
    if (c.free_gain) text << '|' << *c.free_gain;
  }
  return text.str();
}

inline std::string journalOf(MapFile& file) {
  std::ostringstream text;
  text.precision(17);
  for (const std::string& settings : file.settings()) text << settings << '|';
  for (const Eigen::AlignedBox3d& box : file.clearedBoxes()) {
    text << box.min().transpose() << '|' << box.max().transpose() << '|';
  }
  for (const ScanRecord& scan : file.scans()) {
    text << scan.number << '|' << scan.drive << '|' << scan.stamp << '|' << scan.sensor << '|'
         << scan.settings << '|' << scan.cleared << '|' << scan.jump << '|' << scan.reach << '|'
         << scan.T_map_sensor.matrix() << '|' << scan.T_odometry_sensor.matrix();
    for (const GridIndex& tile : scan.tiles) text << '|' << tile.x << ',' << tile.y << ',' << tile.z;
    text << '|' << file.scanContent(scan.number) << '\n';
  }
  return text.str();
}

inline SemanticMap readPart(MapFile& file, int part) {
  SemanticMap map = file.info().emptyMap();
  for (const TileEntry& tile : file.tiles(part)) EXPECT_TRUE(file.addTileTo(map, {tile.index, part}));
  return map;
}

inline std::string readFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void writeFile(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

/// Reads all of a file.
inline FileContent contentOf(MapFile& file) {
  FileContent content{textOf(file.info()), file.drives(), {}, journalOf(file)};
  for (const int part : file.parts()) content.parts[part] = reference::contentOf(readPart(file, part));
  return content;
}
inline FileContent contentOf(const std::string& path) {
  MapFile file(path, MapFile::Access::kRead);
  return contentOf(file);
}

}  // namespace bki_mapping
