// Every mode equals brute force on real scans. Needs the environment variable BKI_MAPPING_TEST_DATA: a folder
// that holds semantickitti/sequences/04. Skips with a message if it is not set.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/sequence/sequence.h"
#include "bki_mapping/settings/yaml.h"
#include "free_space/free_space_model.h"
#include "reference/reference.h"

namespace bki_mapping {
namespace {

void expectSampledVoxelsEqualBruteForce(const Scan& scan, const MapperConfig& config,
                                        const std::string& what) {
  const auto classes = std::make_shared<const ClassTable>(loadClassTable("semantic_kitti"));
  SemanticMapper mapper(config, classes);
  mapper.integrate(scan);
  const reference::ScanReference brute(scan, *classes, config);
  const auto blocks = sortedBlocks(mapper.map());
  std::mt19937 random(4);
  double free_seen = 0.0;
  for (int trial = 0; trial < 150; ++trial) {
    // Voxels of the map and, every fifth time, voxels one block above, which may lie outside the map.
    VoxelIndex voxel =
        GridGeometry::voxelOf(blocks[random() % blocks.size()].first, static_cast<int>(random() % 512));
    if (trial % 5 == 4) voxel.z += kBlockEdge;
    const Block* block = mapper.map().find(GridGeometry::blockOf(voxel));
    for (int label = -1; label < 20; ++label) {
      const ClassId id = label < 0 ? kFreeClass : static_cast<ClassId>(label);
      if (id != kFreeClass && trial % 5) continue;  // most voxels have no hits
      const EvidenceUnits* plane = block ? block->evidence(id) : nullptr;
      const double got =
          plane ? static_cast<double>(evidenceOf(plane[GridGeometry::offsetInBlock(voxel)])) : 0.0;
      const reference::Value truth = brute.evidence(voxel, id);
      ASSERT_NEAR(got, truth.sum, 2e-5 + 5e-5 * truth.sum + truth.slack) << what << ", class " << int{id};
      if (id == kFreeClass) free_seen += truth.sum;
    }
  }
  EXPECT_EQ(free_seen > 0.0, config.free_space.mode != "none") << what;
}

TEST(RealScan, EveryModeEqualsBruteForce) {
  const char* data = std::getenv("BKI_MAPPING_TEST_DATA");
  if (!data) GTEST_SKIP() << "SKIPPED: BKI_MAPPING_TEST_DATA is not set; no law was tested on real scans";
  const Sequence sequence(std::string(data) + "/semantickitti/sequences/04");
  const Scan scan = sequence.read(5).scan();
  for (const std::string& mode : freeSpaceModes()) {
    for (const KernelType kernel : {KernelType::kSparse, KernelType::kCounting}) {
      MapperConfig config;
      config.free_space.mode = mode;
      config.kernel.type = kernel;
      expectSampledVoxelsEqualBruteForce(scan, config, mode);
    }
  }
  for (const BeamWeight weight : {BeamWeight::kUniform, BeamWeight::kLinear, BeamWeight::kBilinear}) {
    for (const FreeSpaceExtent extent : {FreeSpaceExtent::kMapped, FreeSpaceExtent::kObserved}) {
      MapperConfig config;
      config.free_space.weight = weight;
      config.free_space.extent = extent;
      expectSampledVoxelsEqualBruteForce(scan, config, "line");
    }
  }
}

}  // namespace
}  // namespace bki_mapping
