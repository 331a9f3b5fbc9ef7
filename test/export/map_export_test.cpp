// Map files: their bytes, reading them with PCL, and that the old file survives a failure.
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>

#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <set>

#include "bki_mapping/export/map_export.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "core/atomic_file.h"
#include "core/float_origin.h"
#include "reference/scenes.h"
#include "temporary_folder.h"

namespace bki_mapping {
namespace {

const VoxelStates kAll = {VoxelState::kOccupied, VoxelState::kFree, VoxelState::kOccluded};

class MapExport : public testing::Test {
 protected:
  void SetUp() override {
    MapperConfig config;
    config.occlusion = OcclusionExtent::kMapped;
    mapper_ = std::make_unique<SemanticMapper>(config, reference::smallTable());
    mapper_->integrate(reference::nastyScenes()[0].scan);
  }
  void write(const std::string& path, const VoxelStates& states) {
    exportMap(path, mapper_->map(), mapper_->rules(), mapper_->classes(), states);
  }
  static std::string read(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  }

  TemporaryFolder folder_;
  std::unique_ptr<SemanticMapper> mapper_;
};

TEST_F(MapExport, PlyHasOneVertexAVoxel) {
  write(folder_ / "map.ply", kAll);
  const std::string bytes = read(folder_ / "map.ply");
  const std::string end = "end_header\n";
  const std::size_t header = bytes.find(end) + end.size();
  const auto voxels = collectVoxels(mapper_->map(), mapper_->rules(), mapper_->classes(), kAll);
  ASSERT_GT(voxels.size(), 100u);
  EXPECT_EQ(bytes.size() - header, voxels.size() * 42);
  EXPECT_NE(bytes.find("format binary_little_endian 1.0\n"), std::string::npos);
  EXPECT_NE(bytes.find("element vertex " + std::to_string(voxels.size()) + "\n"), std::string::npos);
  for (const std::size_t i : {std::size_t{0}, voxels.size() / 2, voxels.size() - 1}) {
    const char* record = bytes.data() + header + 42 * i;
    float x = 0.0f, occupancy = 0.0f, evidence = 0.0f;
    std::uint16_t label = 0;
    std::memcpy(&x, record, 4);
    std::memcpy(&label, record + 15, 2);
    std::memcpy(&occupancy, record + 22, 4);
    std::memcpy(&evidence, record + 38, 4);
    EXPECT_EQ(x, static_cast<float>(voxels[i].x));
    EXPECT_EQ(label, voxels[i].label);
    EXPECT_EQ(static_cast<std::uint8_t>(record[17]), voxels[i].state);
    EXPECT_EQ(occupancy, voxels[i].occupancy);
    EXPECT_EQ(evidence, voxels[i].evidence);
  }
}

TEST_F(MapExport, PclReadsBothFormats) {
  write(folder_ / "map.ply", kAll);
  write(folder_ / "map.pcd", kAll);
  pcl::PointCloud<pcl::PointXYZRGB> ply, pcd;
  ASSERT_EQ(pcl::io::loadPLYFile(folder_ / "map.ply", ply), 0);
  ASSERT_EQ(pcl::io::loadPCDFile(folder_ / "map.pcd", pcd), 0);
  const auto voxels = collectVoxels(mapper_->map(), mapper_->rules(), mapper_->classes(), kAll);
  ASSERT_EQ(ply.size(), voxels.size());
  ASSERT_EQ(pcd.size(), voxels.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    EXPECT_EQ(ply[i].x, static_cast<float>(voxels[i].x));
    EXPECT_EQ(pcd[i].z, static_cast<float>(voxels[i].z));
    EXPECT_EQ(ply[i].g, voxels[i].green);
    EXPECT_EQ(pcd[i].r, voxels[i].red);
  }
}

/// The same scan, mapped at 0.1 m in UTM coordinates.
class FarMapExport : public MapExport {
 protected:
  void SetUp() override {
    MapperConfig config;
    config.resolution = 0.1;
    mapper_ = std::make_unique<SemanticMapper>(config, reference::smallTable());
    Scan scan = reference::nastyScenes()[0].scan;
    scan.origin += kPlace;
    mapper_->integrate(scan);
    map_voxels_.clear();
    forEachKnownVoxel(mapper_->map(), mapper_->rules(), [&](const VoxelIndex& voxel, const VoxelView&) {
      const Eigen::Vector3d at = mapper_->map().geometry().voxelCentre(voxel);
      map_voxels_.insert({at.x(), at.y(), at.z()});
    });
  }
  using Place = std::array<double, 3>;

  const Eigen::Vector3d kPlace{500000.0, 4000000.0, 30.0};
  std::set<Place> map_voxels_;  ///< centres
};

TEST_F(FarMapExport, PlyHoldsDoubles) {
  write(folder_ / "map.ply", kAll);
  const std::string bytes = read(folder_ / "map.ply"), end = "end_header\n";
  EXPECT_NE(bytes.find("property double x\nproperty double y\nproperty double z\n"), std::string::npos);
  const std::size_t header = bytes.find(end) + end.size();
  ASSERT_EQ(bytes.size() - header, map_voxels_.size() * 54);
  std::set<Place> places;
  for (std::size_t at = header; at < bytes.size(); at += 54) {
    Place place;
    std::memcpy(place.data(), bytes.data() + at, sizeof place);
    places.insert(place);
  }
  EXPECT_EQ(places, map_voxels_);
}

TEST_F(FarMapExport, PcdIsRelativeToItsViewpoint) {
  write(folder_ / "map.pcd", kAll);
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  ASSERT_EQ(pcl::io::loadPCDFile(folder_ / "map.pcd", cloud), 0);
  EXPECT_EQ(cloud.sensor_origin_.head<3>(), Eigen::Vector3f(500000.0f, 4000000.0f, 0.0f));
  EXPECT_TRUE(cloud.sensor_orientation_.isApprox(Eigen::Quaternionf::Identity()));
  ASSERT_EQ(cloud.size(), map_voxels_.size());
  std::set<VoxelIndex> voxels;
  for (const pcl::PointXYZRGB& point : cloud) {
    const Eigen::Vector3d at =
        cloud.sensor_origin_.head<3>().cast<double>() + point.getVector3fMap().cast<double>();
    const VoxelIndex voxel = mapper_->map().geometry().voxelAt(at);
    EXPECT_LT((mapper_->map().geometry().voxelCentre(voxel) - at).norm(), 1e-4);
    voxels.insert(voxel);
  }
  EXPECT_EQ(voxels.size(), map_voxels_.size());
}

TEST_F(FarMapExport, RecordsHoldDoubles) {
  std::set<Place> places;
  for (const VoxelRecord& v : collectVoxels(mapper_->map(), mapper_->rules(), mapper_->classes(), kAll)) {
    places.insert({v.x, v.y, v.z});
  }
  EXPECT_EQ(places, map_voxels_);
}

TEST(FloatOrigin, IsZeroUntilFloatsAreTooCoarse) {
  // 0.1 m voxels tolerate 0.01 m. Up to 2^18 m, floats are 2^-6 m apart; then 2^-5, and rounding moves by
  // half.
  const Eigen::Vector3d near(262143.0, -100.0, 3.0), far(100.0, -262144.0, 3.0);
  EXPECT_FALSE(tooFarForFloats(near, 0.1));
  EXPECT_TRUE(tooFarForFloats(far, 0.1));
  EXPECT_FALSE(tooFarForFloats(far, 0.3));
  EXPECT_EQ(floatOrigin(near, 0.1), Eigen::Vector3d::Zero());
  EXPECT_EQ(floatOrigin(far, 0.1), Eigen::Vector3d(0.0, -262000.0, 0.0));
  EXPECT_EQ(floatSpacing(-4000000.0), 0.25);
  EXPECT_EQ(floatSpacing(500000.0), 0.03125);
}

TEST_F(MapExport, HoldsTheStatesAskedFor) {
  std::size_t sum = 0;
  for (const VoxelState state : {VoxelState::kOccupied, VoxelState::kFree, VoxelState::kOccluded}) {
    const auto voxels = collectVoxels(mapper_->map(), mapper_->rules(), mapper_->classes(), {state});
    EXPECT_GT(voxels.size(), 0u) << static_cast<int>(state);
    for (const VoxelRecord& v : voxels) EXPECT_EQ(v.state, static_cast<int>(state));
    sum += voxels.size();
  }
  EXPECT_EQ(sum, collectVoxels(mapper_->map(), mapper_->rules(), mapper_->classes(), kAll).size());
  EXPECT_EQ(parseStates("occupied,free,occluded"), kAll);
  EXPECT_THROW(parseStates("occupied,fre"), std::invalid_argument);
}

TEST_F(MapExport, RefusesOtherEndingsAndFolders) {
  EXPECT_THROW(write(folder_ / "map.obj", kAll), std::invalid_argument);
  EXPECT_THROW(write(folder_ / "none/map.ply", kAll), std::runtime_error);
  EXPECT_EQ(folder_.fileCount(), 0u);
}

TEST_F(MapExport, AFailureLeavesTheOldFile) {
  const std::string path = folder_ / "map.ply";
  writeTextFile(path, "a good map");
  {
    const FullDisk full(1000);
    EXPECT_THROW(write(path, kAll), std::runtime_error);
    EXPECT_THROW(write(folder_ / "map.pcd", kAll), std::runtime_error);
  }
  EXPECT_EQ(read(path), "a good map");
  EXPECT_EQ(folder_.fileCount(), 1u) << "temporary files are left";
}

}  // namespace
}  // namespace bki_mapping
