// Map files: their bytes, reading them with PCL, and that the old file survives a failure.
#include <gtest/gtest.h>
#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>
#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <iterator>

#include "bki_mapping/io/map_export.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "core/atomic_file.h"
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
    exportMap(path, mapper_->map(), mapper_->classes(), states);
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
  const auto voxels = collectVoxels(mapper_->map(), mapper_->classes(), kAll);
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
    EXPECT_EQ(x, voxels[i].x);
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
  const auto voxels = collectVoxels(mapper_->map(), mapper_->classes(), kAll);
  ASSERT_EQ(ply.size(), voxels.size());
  ASSERT_EQ(pcd.size(), voxels.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    EXPECT_EQ(ply[i].x, voxels[i].x);
    EXPECT_EQ(pcd[i].z, voxels[i].z);
    EXPECT_EQ(ply[i].g, voxels[i].green);
    EXPECT_EQ(pcd[i].r, voxels[i].red);
  }
}

TEST_F(MapExport, HoldsTheStatesAskedFor) {
  std::size_t sum = 0;
  for (const VoxelState state : {VoxelState::kOccupied, VoxelState::kFree, VoxelState::kOccluded}) {
    const auto voxels = collectVoxels(mapper_->map(), mapper_->classes(), {state});
    EXPECT_GT(voxels.size(), 0u) << static_cast<int>(state);
    for (const VoxelRecord& v : voxels) EXPECT_EQ(v.state, static_cast<int>(state));
    sum += voxels.size();
  }
  EXPECT_EQ(sum, collectVoxels(mapper_->map(), mapper_->classes(), kAll).size());
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
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};  // simulates a full disk
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(write(path, kAll), std::runtime_error);
  EXPECT_THROW(write(folder_ / "map.pcd", kAll), std::runtime_error);
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(read(path), "a good map");
  EXPECT_EQ(folder_.fileCount(), 1u) << "temporary files are left";
}

}  // namespace
}  // namespace bki_mapping
