// The files for map_server: the cells of projected_map where map_server reads them.
#include "export/grid_export.h"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <fstream>
#include <set>
#include <sstream>

#include "store/map_maker.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

/// What map_server (1.14, mode trinary) makes of the files: a cell by the coordinates of a point in it.
class ServedMap {
 public:
  explicit ServedMap(const std::string& path) {
    const YAML::Node yaml = YAML::LoadFile(path);
    resolution_ = yaml["resolution"].as<double>();
    origin_ = {yaml["origin"][0].as<double>(), yaml["origin"][1].as<double>()};
    EXPECT_EQ(yaml["origin"][2].as<double>(), 0.0);
    EXPECT_EQ(yaml["mode"].as<std::string>(), "trinary");
    EXPECT_EQ(yaml["negate"].as<int>(), 0);
    occupied_ = yaml["occupied_thresh"].as<double>();
    free_ = yaml["free_thresh"].as<double>();
    const std::string image = path.substr(0, path.rfind('/') + 1) + yaml["image"].as<std::string>();
    std::ifstream file(image, std::ios::binary);
    std::string magic;
    int most = 0;
    file >> magic >> width >> height >> most;
    EXPECT_EQ(magic, "P5");
    EXPECT_EQ(most, 255);
    file.get();
    pixels_.assign(std::istreambuf_iterator<char>(file), {});
    EXPECT_EQ(pixels_.size(), static_cast<std::size_t>(width * height));
  }
  int at(double x, double y) const {
    const int column = static_cast<int>(std::floor((x - origin_.x()) / resolution_));
    const int row = static_cast<int>(std::floor((y - origin_.y()) / resolution_));
    if (column < 0 || column >= width || row < 0 || row >= height) return -1;
    const int grey =
        static_cast<unsigned char>(pixels_[static_cast<std::size_t>((height - 1 - row) * width + column)]);
    const double occupancy = (255 - grey) / 255.0;
    return occupancy > occupied_ ? 100 : occupancy < free_ ? 0 : -1;
  }

  int width = 0, height = 0;

 private:
  double resolution_ = 0.0, occupied_ = 0.0, free_ = 0.0;
  Eigen::Vector2d origin_;
  std::string pixels_;
};

TEST(GridExport, IsTheProjectedMap) {
  const TemporaryFolder folder;
  const SemanticMap map = randomMap(5, 80, 5);
  const auto table = infoOf().classes;
  const ClassTable& classes = *table;
  for (const ColumnRules& rules : {ColumnRules(), ColumnRules{-9.0, -5.0, HeightReference::kMap},
                                   ColumnRules{0.2, 3.0, HeightReference::kGround}}) {
    exportGrid(folder / "a map: \"1\".yaml", map, StateRules(), classes, rules);
    const ServedMap served(folder / "a map: \"1\".yaml");
    ColumnMap columns;
    columns.start(rules);
    std::vector<GridIndex> blocks;
    for (const auto& [index, block] : map.entries()) blocks.push_back(index);
    columns.update(map, StateRules(), classes, blocks);
    std::set<int> seen;
    for (const auto& [stack, views] : columns.columns()) {
      for (int y = 0; y < kBlockEdge; ++y) {
        for (int x = 0; x < kBlockEdge; ++x) {
          const Eigen::Vector3d centre =
              map.geometry().voxelCentre({{kBlockEdge * stack.first + x, kBlockEdge * stack.second + y, 0}});
          const int occupancy =
              static_cast<int>(views[static_cast<std::size_t>(x + kBlockEdge * y)].occupancy);
          seen.insert(occupancy);
          ASSERT_EQ(served.at(centre.x(), centre.y()), occupancy) << centre.transpose();
        }
      }
    }
    EXPECT_GE(seen.size(), 2u);
    EXPECT_EQ(served.at(1000.0, 0.0), -1);
  }
  EXPECT_EQ(folder.fileCount(), 2u);
}

TEST(GridExport, RefusesImagesThatAreTooLargeOrEmpty) {
  const TemporaryFolder folder;
  SemanticMap map = infoOf().emptyMap();
  EXPECT_THROW(exportGrid(folder / "a.yaml", map, StateRules(), *infoOf().classes, {}),
               std::invalid_argument);
  const std::vector<EvidenceUnits> plane(kBlockVoxels, 9);
  map.getOrAllocate({{-(1 << 24), -(1 << 24), 0}}).add(40, plane.data());
  map.getOrAllocate({{1 << 24, 1 << 24, 0}}).add(40, plane.data());
  EXPECT_THROW(exportGrid(folder / "a.yaml", map, StateRules(), *infoOf().classes, {}),
               std::invalid_argument);
  EXPECT_EQ(folder.fileCount(), 0u);
}

}  // namespace
}  // namespace bki_mapping
