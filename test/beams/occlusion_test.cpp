// Occlusion equals brute force, and is right on scenes worked out by hand.
#include <gtest/gtest.h>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "reference/reference.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

MapperConfig configOf(OcclusionExtent extent, KernelType kernel) {
  MapperConfig config;
  config.free_space.mode = "none";
  config.occlusion = extent;
  config.kernel.type = kernel;
  config.sensor_model.max_range = 6.0;
  return config;
}

void expectEqualsBruteForce(const reference::Scene& scene, const MapperConfig& config) {
  const auto classes = reference::smallTable();
  SemanticMapper mapper(config, classes);
  mapper.integrate(scene.scan);
  const reference::ScanReference brute(scene.scan, *classes, config);
  std::size_t marked = 0, faults = 0;
  for (const auto& entry : mapper.map().entries()) {
    for (int v = 0; v < kBlockVoxels; ++v) {
      const int truth = brute.occluded(GridGeometry::voxelOf(entry.index, v), config.sensor_model.max_range);
      const bool got = entry.block->occlusion()[static_cast<std::size_t>(v)];
      if (truth == -2) continue;
      marked += truth == 1;
      faults += got != (truth == 1);
    }
  }
  EXPECT_EQ(faults, 0u) << scene.name;
  EXPECT_GT(marked, 0u) << scene.name;
}

TEST(Occlusion, EqualsBruteForceInItsBlocks) {
  for (const reference::Scene& scene : reference::nastyScenes(40)) {
    for (const KernelType kernel : {KernelType::kSparse, KernelType::kCounting}) {
      expectEqualsBruteForce(scene, configOf(OcclusionExtent::kMapped, kernel));
    }
    if (scene.name == "everywhere" || scene.name == "seam") {
      expectEqualsBruteForce(scene, configOf(OcclusionExtent::kAll, KernelType::kSparse));
    }
  }
}

Scan oneHit(float x) {
  Scan scan;
  scan.origin = {0.15, 0.15, 0.15};
  scan.points = {{x, 0.0f, 0.0f}};
  scan.labels = {10};
  return scan;
}

VoxelState stateAt(const SemanticMapper& mapper, double x) {
  return viewPoint(mapper.map(), mapper.rules(), {x, 0.15, 0.15}).state;
}

TEST(Occlusion, MarksBehindTheHitUntilABeamPasses) {
  MapperConfig config = configOf(OcclusionExtent::kAll, KernelType::kSparse);
  config.free_space.mode = "line";
  SemanticMapper mapper(config, reference::smallTable());
  mapper.integrate(oneHit(3.0f));
  EXPECT_EQ(stateAt(mapper, 1.65), VoxelState::kFree);
  EXPECT_EQ(stateAt(mapper, 3.15), VoxelState::kOccupied);
  EXPECT_EQ(stateAt(mapper, 4.35), VoxelState::kOccluded);
  EXPECT_EQ(stateAt(mapper, 7.35), VoxelState::kUnknown) << "shadows end at max_range";
  mapper.integrate(oneHit(5.4f));
  EXPECT_EQ(stateAt(mapper, 4.35), VoxelState::kFree);
}

TEST(Occlusion, NoneMarksNothing) {
  SemanticMapper mapper(configOf(OcclusionExtent::kNone, KernelType::kSparse), reference::smallTable());
  mapper.integrate(oneHit(3.0f));
  for (const auto& entry : mapper.map().entries()) EXPECT_TRUE(entry.block->occlusion().none());
}

TEST(Occlusion, MappedMakesNoBlocks) {
  SemanticMapper none(configOf(OcclusionExtent::kNone, KernelType::kSparse), reference::smallTable());
  SemanticMapper mapped(configOf(OcclusionExtent::kMapped, KernelType::kSparse), reference::smallTable());
  SemanticMapper all(configOf(OcclusionExtent::kAll, KernelType::kSparse), reference::smallTable());
  for (SemanticMapper* mapper : {&none, &mapped, &all}) mapper->integrate(oneHit(3.0f));
  EXPECT_EQ(none.map().size(), mapped.map().size());
  EXPECT_GT(all.map().size(), mapped.map().size());
}

}  // namespace
}  // namespace bki_mapping
