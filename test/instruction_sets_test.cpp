// The law on every instruction set that this processor has: each is forced in turn.
#include <gtest/gtest.h>

#include <algorithm>

#include "bki_mapping/inference/beam_evidence.h"
#include "bki_mapping/inference/map_updater.h"
#include "reference/reference.h"
#include "reference/scenes.h"

namespace bki_mapping {
namespace {

/// Voxels of the map whose free evidence is not the brute-force sum.
std::size_t faultsOf(const SemanticMap& map, const reference::ScanReference& brute,
                     const MapperConfig& config) {
  std::size_t faults = 0;
  for (const auto& entry : map.entries()) {
    const float* free = entry.block->evidence(kFreeClass);
    for (int v = 0; v < kBlockVoxels; ++v) {
      const reference::Value truth = brute.evidence(GridGeometry::voxelOf(entry.index, v), kFreeClass);
      const double tolerance = 2e-5 * config.kernel.scale + 2e-5 * truth.sum + truth.slack;
      faults += std::abs(free[v] - truth.sum) > tolerance;
    }
  }
  return faults;
}

TEST(InstructionSets, GenericIsAlwaysThere) {
  EXPECT_EQ(instructionSets().front(), "generic");
  EXPECT_THROW(addBeamRowsFor("abacus"), std::invalid_argument);
}

TEST(InstructionSets, EachEqualsBruteForce) {
  const GridGeometry geometry(0.3);
  for (const std::string& set : instructionSets()) {
    for (const reference::Scene& scene : reference::nastyScenes(60)) {
      for (const BeamWeight weight : {BeamWeight::kUniform, BeamWeight::kLinear, BeamWeight::kBilinear}) {
        MapperConfig config;
        config.downsample_resolution = 0.0;
        config.free_space.weight = weight;
        const Beams beams{scene.scan.origin, scene.scan.points};
        const auto field =
            std::make_shared<const BeamField>(geometry, config.kernel, BeamIndexType::kTable, beams);
        const BeamEvidence evidence(field, weight, FreeSpaceExtent::kObserved, set);
        SemanticMap map(geometry, config.prior, 4);
        updateMap(map, {&evidence}, 2);
        ASSERT_GT(map.size(), 0u);
        const reference::ScanReference brute(scene.scan, *reference::smallTable(), config);
        EXPECT_EQ(faultsOf(map, brute, config), 0u) << set << ", " << scene.name;
      }
    }
  }
}

}  // namespace
}  // namespace bki_mapping
