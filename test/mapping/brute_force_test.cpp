// The law: with every mode and kernel, the map equals the brute-force sum at every voxel, inside and outside
// of its blocks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "free_space/free_space_model.h"
#include "other_value.h"
#include "reference/reference.h"
#include "reference/scenes.h"
#include "rules/rules_parameters.h"

namespace bki_mapping {
namespace {

/// The box of voxels that contains all hits and the sensor, with a margin of 1.2 m.
std::pair<VoxelIndex, VoxelIndex> bounds(const Scan& scan, const GridGeometry& geometry) {
  Eigen::Vector3d low = scan.origin, high = scan.origin;
  for (const auto& point : scan.points) {
    low = low.cwiseMin(scan.origin + point.cast<double>());
    high = high.cwiseMax(scan.origin + point.cast<double>());
  }
  for (const auto& direction : scan.no_returns) {
    const Eigen::Vector3d end =
        scan.origin + direction.cast<double>().normalized() * scan.sensor_model->max_range;
    low = low.cwiseMin(end);
    high = high.cwiseMax(end);
  }
  const Eigen::Vector3d margin = Eigen::Vector3d::Constant(1.2);
  return {geometry.voxelAt(low - margin), geometry.voxelAt(high + margin)};
}

float evidenceAt(const SemanticMap& map, const VoxelIndex& voxel, ClassId label) {
  const Block* block = map.find(GridGeometry::blockOf(voxel));
  const EvidenceUnits* plane = block ? block->evidence(label) : nullptr;
  return plane ? evidenceOf(plane[GridGeometry::offsetInBlock(voxel)]) : 0.0f;
}

void expectEqualsBruteForce(const Scan& scan, const MapperConfig& config, const std::string& what,
                            const std::shared_ptr<const ClassTable>& classes = reference::smallTable()) {
  SemanticMapper mapper(config, classes);
  mapper.integrate(scan);
  const reference::ScanReference brute(scan, *classes, config);
  const double scale = applied(config).kernel.scale;
  const auto [low, high] = bounds(scan, mapper.map().geometry());
  double free_seen = 0.0;
  std::size_t faults = 0, inside = 0;
  for (VoxelIndex v = low; v.z <= high.z; ++v.z) {
    for (v.y = low.y; v.y <= high.y; ++v.y) {
      for (v.x = low.x; v.x <= high.x; ++v.x) {
        for (const int label : {0, 1, 2, 3, 255}) {
          const auto id = static_cast<ClassId>(label);
          const reference::Value truth = brute.evidence(v, id);
          const double got = evidenceAt(mapper.map(), v, id);
          if (std::abs(got - truth.sum) > truth.tolerance(scale) && ++faults < 5) {
            ADD_FAILURE() << what << ": voxel " << v.x << ' ' << v.y << ' ' << v.z << " class " << label
                          << " has evidence " << got << ", but the brute-force sum is " << truth.sum;
          }
          if (id == kFreeClass) free_seen += truth.sum;
        }
      }
    }
  }
  EXPECT_EQ(faults, 0u) << what;
  for (const auto& entry : mapper.map().entries()) {
    const VoxelIndex first = GridGeometry::voxelOf(entry.index, 0);
    inside += first.x + kBlockEdge > low.x && first.x <= high.x && first.y + kBlockEdge > low.y &&
              first.y <= high.y && first.z + kBlockEdge > low.z && first.z <= high.z;
  }
  EXPECT_EQ(inside, mapper.map().size()) << what << ": blocks lie outside the scene";
  // A kernel shorter than a voxel may find nothing to clear.
  if (config.kernel.lengthFor(config.resolution) >= config.resolution) {
    EXPECT_EQ(free_seen > 0.0, config.free_space.mode != "none") << what;
  }
}

MapperConfig withMode(const std::string& mode) {
  MapperConfig config;
  config.free_space.mode = mode;
  config.free_space.gap = 0.4;
  config.free_space.samples_per_beam = 3;
  config.threads = 2;
  return config;
}

class EveryScene : public testing::TestWithParam<std::size_t> {
 protected:
  reference::Scene scene_ = reference::nastyScenes(60)[GetParam()];
};

TEST_P(EveryScene, EveryModeEqualsBruteForce) {
  for (const std::string& mode : freeSpaceModes()) {
    for (const KernelType kernel : {KernelType::kSparse, KernelType::kCounting}) {
      MapperConfig config = withMode(mode);
      config.kernel.type = kernel;
      expectEqualsBruteForce(scene_.scan, config, scene_.name + ", " + mode);
    }
  }
}

TEST_P(EveryScene, HitsBeforeMissesEqualsBruteForce) {
  if (scene_.name == "near the sensor") return;  // nothing is left to clear there
  for (const std::string mode : {"even", "linear", "line"}) {
    for (const KernelType kernel : {KernelType::kSparse, KernelType::kCounting}) {
      MapperConfig config = withMode(mode);
      config.kernel.type = kernel;
      config.scan_rules.hits_before_misses = true;
      expectEqualsBruteForce(scene_.scan, config, scene_.name + ", hits before misses, " + mode);
      config.kernel.length = 0.2;  // may reach no voxel centre
      expectEqualsBruteForce(scene_.scan, config, scene_.name + ", hits before misses, short, " + mode);
      config.free_space.extent = FreeSpaceExtent::kMapped;
      expectEqualsBruteForce(scene_.scan, config, scene_.name + ", hits before misses, mapped, " + mode);
    }
  }
}

TEST_P(EveryScene, LinesEqualBruteForce) {
  for (const BeamWeight weight : {BeamWeight::kUniform, BeamWeight::kLinear, BeamWeight::kBilinear}) {
    for (const FreeSpaceExtent extent : {FreeSpaceExtent::kMapped, FreeSpaceExtent::kObserved}) {
      MapperConfig config = withMode("line");
      config.free_space.weight = weight;
      config.free_space.extent = extent;
      expectEqualsBruteForce(scene_.scan, config, scene_.name + ", line");
      config.free_space.beam_index = BeamIndexType::kRtree;
      expectEqualsBruteForce(scene_.scan, config, scene_.name + ", line by R-tree");
    }
  }
}

TEST_P(EveryScene, CountingLinesEqualBruteForce) {
  MapperConfig config = withMode("line");
  config.kernel.type = KernelType::kCounting;
  config.free_space.weight = BeamWeight::kUniform;
  for (const FreeSpaceExtent extent : {FreeSpaceExtent::kMapped, FreeSpaceExtent::kObserved}) {
    config.free_space.extent = extent;
    expectEqualsBruteForce(scene_.scan, config, scene_.name + ", counting line");
  }
}

TEST_P(EveryScene, OtherSizesEqualBruteForce) {
  MapperConfig config = withMode("line");
  config.resolution = 0.25;
  config.kernel.length = 0.6;
  config.kernel.scale = 3.0;
  config.downsample_resolution = 0.0;
  expectEqualsBruteForce(scene_.scan, config, scene_.name + ", long kernel");
  config.kernel.length = 0.2;
  expectEqualsBruteForce(scene_.scan, config, scene_.name + ", short kernel");
}

TEST_P(EveryScene, RangeLimitsEqualBruteForce) {
  MapperConfig config = withMode("line");
  config.sensor_model.min_range = 0.2;
  config.sensor_model.max_range = 2.0;
  expectEqualsBruteForce(scene_.scan, config, scene_.name + ", cut");
  config.clear_beyond_max_range = false;
  config.unlabelled_points = UnlabelledPoints::kIgnore;
  if (scene_.name != "seam" && scene_.name != "poles" && scene_.name != "cluster") {
    expectEqualsBruteForce(scene_.scan, config, scene_.name + ", not cut");
  }
}

/// The scene with one to three classes for each point in random shares; the label is the likeliest class.
Scan withSoftLabels(Scan scan) {
  std::mt19937 random(17);
  scan.labels_are_ids = true;
  for (std::uint32_t& label : scan.labels) {
    const auto first = static_cast<unsigned>(random() % 3);
    scan.soft.startPoint();
    float best = 0.0f, left = 1.0f;
    for (unsigned id = first; id < 4; ++id) {
      const float share = id == 3 ? left : left * static_cast<float>(random() % 90 + 5) / 100.0f;
      left -= share;
      scan.soft.add({static_cast<ClassId>(id), share});
      if (share > best) label = id;
      best = std::max(best, share);
    }
  }
  return scan;
}

TEST_P(EveryScene, SoftLabelsEqualBruteForce) {
  const Scan scan = withSoftLabels(scene_.scan);
  for (const KernelType kernel : {KernelType::kSparse, KernelType::kCounting}) {
    for (const double length : {0.3, 0.2, 0.7}) {
      MapperConfig config = withMode("line");
      config.kernel.type = kernel;
      config.kernel.length = length;
      expectEqualsBruteForce(scan, config, scene_.name + ", soft labels");
      if (scene_.name == "near the sensor") continue;  // nothing is left to clear there with what follows
      config.scan_rules.hits_before_misses = true;
      config.free_space.extent = FreeSpaceExtent::kMapped;
      config.downsample_resolution = 0.0;
      expectEqualsBruteForce(scan, config, scene_.name + ", soft labels, hits before misses");
    }
  }
}

TEST_P(EveryScene, LimitsOfAScanEqualBruteForce) {
  for (const std::string mode : {"even", "line"}) {
    for (const KernelType kernel : {KernelType::kSparse, KernelType::kCounting}) {
      MapperConfig config = withMode(mode);
      config.kernel.type = kernel;
      config.scan_rules.most_hits = kernel == KernelType::kSparse ? 0.05f : 1.0f;
      config.scan_rules.most_free = kernel == KernelType::kSparse ? 0.03f : 0.4f;
      expectEqualsBruteForce(scene_.scan, config, scene_.name + ", limits, " + mode);
      expectEqualsBruteForce(withSoftLabels(scene_.scan), config,
                             scene_.name + ", soft labels, limits, " + mode);
    }
  }
}

TEST_P(EveryScene, TheThresholdOfFreeSpaceEqualsBruteForce) {
  for (const std::string mode : {"even", "line"}) {
    for (const KernelType kernel : {KernelType::kSparse, KernelType::kCounting}) {
      MapperConfig config = withMode(mode);
      config.kernel.type = kernel;
      config.scan_rules.free_threshold = kernel == KernelType::kSparse ? 0.004f : 0.3f;
      expectEqualsBruteForce(scene_.scan, config, scene_.name + ", threshold, " + mode);
      for (const float most : {0.02f, 0.0005f}) {  // above and below the threshold of the sparse kernel
        config.scan_rules.most_free = most;
        expectEqualsBruteForce(scene_.scan, config, scene_.name + ", threshold and limit, " + mode);
      }
    }
  }
}

TEST_P(EveryScene, TheRulesOfRobotEqualBruteForce) {
  if (scene_.name == "near the sensor") return;  // nothing is left to clear there
  const auto classes = reference::tableWithDynamicClass();
  for (const double height : {0.0, 0.35, 1.7}) {
    MapperConfig config = withMode("line");
    config.rules.enabled = true;
    config.prior = 5.0;  // these follow from the rules
    config.kernel.scale = 7.0;
    config.downsample_resolution = 0.11;  // three cells along the edge of a voxel
    Scan scan = scene_.scan;
    if (scan.sensor_model) scan.sensor_model->height = height;
    config.sensor_model.height = height;
    expectEqualsBruteForce(scan, config, scene_.name + ", rules", classes);
    expectEqualsBruteForce(withSoftLabels(scan), config, scene_.name + ", soft, rules", classes);
  }
}

TEST_P(EveryScene, EveryParameterOfTheRulesEqualsBruteForce) {
  if (scene_.name == "near the sensor") return;  // nothing is left to clear there
  for (const auto& parameter : rulesParameters()) {
    MapperConfig config = withMode("line");
    config.rules.enabled = true;
    config.sensor_model.height = 1.7;
    if (parameter.name == "enabled") continue;
    parameter.set(config.rules, otherValue(parameter, config.rules));
    Scan scan = scene_.scan;
    if (scan.sensor_model) scan.sensor_model->height = 1.7;
    expectEqualsBruteForce(scan, config, scene_.name + ", other rules/" + parameter.name,
                           reference::tableWithDynamicClass());
  }
}

TEST_P(EveryScene, HitsThatStayInTheirVoxelsEqualBruteForce) {
  const auto classes = reference::tableWithDynamicClass();
  for (const double length : {0.3, 0.2, 0.7}) {
    MapperConfig config = withMode("line");
    config.scan_rules.static_spread = false;
    config.kernel.length = length;
    expectEqualsBruteForce(scene_.scan, config, scene_.name + ", static hits stay", classes);
    expectEqualsBruteForce(withSoftLabels(scene_.scan), config, scene_.name + ", soft, static hits stay",
                           classes);
    config.scan_rules.hits_before_misses = true;
    config.scan_rules.most_hits = 0.05f;
    config.scan_rules.most_free = 1e-3f;
    config.scan_rules.free_threshold = 1.5e-3f;
    config.scan_rules.void_evidence = 0.5f;
    if (scene_.name == "near the sensor") continue;  // nothing is left to clear there
    expectEqualsBruteForce(scene_.scan, config, scene_.name + ", static hits stay, rules", classes);
    if (scene_.name == "cluster") continue;  // in blocks that hold hits, nothing exceeds the threshold
    config.free_space.extent = FreeSpaceExtent::kMapped;
    expectEqualsBruteForce(withSoftLabels(scene_.scan), config,
                           scene_.name + ", soft, static hits stay, rules, mapped", classes);
  }
}

/// The number of voxels that a scan alone sees empty with all their neighbours. @param evidence of a void.
std::size_t countVoids(const Scan& scan, SemanticMapper& mapper, float evidence) {
  mapper.reset();
  mapper.integrate(scan);
  std::size_t count = 0;
  for (const auto& entry : mapper.map().entries()) {
    const EvidenceUnits* const free = entry.block->evidence(kFreeClass);
    for (int v = 0; free && v < kBlockVoxels; ++v) count += evidenceOf(free[v]) >= evidence;
  }
  return count;
}
std::size_t countVoids(const Scan& scan, const MapperConfig& config) {
  SemanticMapper mapper(config, reference::smallTable());
  return countVoids(scan, mapper, config.scan_rules.void_evidence);
}

TEST_P(EveryScene, VoidsEqualBruteForce) {
  for (const std::string mode : {"even", "line"}) {
    MapperConfig config = withMode(mode);
    config.scan_rules.most_free = mode == "line" ? 1e-3f : 1e-4f;
    config.scan_rules.void_evidence = 0.5f;
    expectEqualsBruteForce(scene_.scan, config, scene_.name + ", voids, " + mode);
    config.scan_rules.free_threshold = 5.0f * config.scan_rules.most_free;
    expectEqualsBruteForce(scene_.scan, config, scene_.name + ", voids, threshold, " + mode);
    config.scan_rules.thin_reach = 1;
    expectEqualsBruteForce(scene_.scan, config, scene_.name + ", voids, threshold, thin things, " + mode);
    config.scan_rules.thin_reach = 0;
    config.scan_rules.void_margin = 2;
    expectEqualsBruteForce(scene_.scan, config, scene_.name + ", voids, threshold, margin, " + mode,
                           reference::tableWithDynamicClass());
    config.scan_rules.void_margin = 0;
    config.scan_rules.free_threshold = 0.0f;
    config.scan_rules.hits_before_misses = true;
    config.free_space.extent = FreeSpaceExtent::kMapped;
    if (scene_.name != "near the sensor") {
      expectEqualsBruteForce(withSoftLabels(scene_.scan), config,
                             scene_.name + ", soft labels, voids, " + mode);
    }
  }
}

TEST_P(EveryScene, NoReturnsEqualBruteForce) {
  Scan scan = scene_.scan;
  for (int i = 0; i < 40; ++i) {
    scan.no_returns.emplace_back(std::cos(0.1f * static_cast<float>(i)),
                                 std::sin(0.4f * static_cast<float>(i)),
                                 0.02f * static_cast<float>(i) - 0.3f);
  }
  scan.sensor_model = SensorModelConfig();
  scan.sensor_model->max_range = 2.5;
  expectEqualsBruteForce(scan, withMode("line"), scene_.name + ", no returns, line");
  expectEqualsBruteForce(scan, withMode("even"), scene_.name + ", no returns, even");
  for (Eigen::Vector3f direction : scan.no_returns) {  // the same beams as points at the sensor's range
    scan.points.push_back(direction.normalized() * 2.5f);
    scan.labels.push_back(10);
  }
  scan.no_returns.clear();
  scan.no_returns_at_max_range = true;
  expectEqualsBruteForce(scan, withMode("line"), scene_.name + ", points at the maximum, line");
}

/// Hits of all classes on a sphere around the sensor.
Scan denseHits() {
  Scan scan;
  scan.origin = {0.1, 0.2, 0.3};
  for (int row = -8; row <= 8; ++row) {
    for (int column = 0; column < 45; ++column) {
      const auto elevation = 0.09f * static_cast<float>(row), azimuth = 0.14f * static_cast<float>(column);
      scan.points.emplace_back(2.0f * std::cos(elevation) * std::cos(azimuth),
                               2.0f * std::cos(elevation) * std::sin(azimuth), 2.0f * std::sin(elevation));
      scan.labels.push_back(static_cast<std::uint32_t>(10 * (column % 4)));
    }
  }
  return scan;
}

TEST(Voids, LieBetweenTheSensorAndDenseHitsAndEqualBruteForce) {
  const Scan scan = denseHits();
  MapperConfig config = withMode("line");
  config.scan_rules.most_free = 1e-3f;
  config.scan_rules.void_evidence = 0.5f;
  expectEqualsBruteForce(scan, config, "voids among dense beams");
  const std::size_t voids = countVoids(scan, config);
  EXPECT_GT(voids, 0u);
  config.scan_rules.thin_reach = 2;  // the upper half of the hits are above voxels that are seen empty
  expectEqualsBruteForce(scan, config, "voids among dense beams, thin things");
  EXPECT_GT(countVoids(scan, config), voids / 4);
  EXPECT_LT(countVoids(scan, config), voids);
  config.scan_rules.thin_reach = 0;
  config.scan_rules.void_margin = 2;
  expectEqualsBruteForce(scan, config, "voids among dense beams, margin");
  expectEqualsBruteForce(scan, config, "voids among dense beams, margin, what can move",
                         reference::tableWithDynamicClass());
  const std::size_t voids_far_away = countVoids(scan, config);
  EXPECT_LT(voids_far_away, voids);
  EXPECT_GT(voids_far_away, 0u);
  config.scan_rules.void_margin = 0;
  config.scan_rules.free_threshold = 1e3f;  // above all that beams add
  expectEqualsBruteForce(scan, config, "voids among dense beams, threshold");
  EXPECT_EQ(countVoids(scan, config), voids);
  config.scan_rules.most_free = ScanRules().most_free;  // nothing says what counts as seen empty
  EXPECT_EQ(countVoids(scan, config), 0u);
}

TEST(Voids, KeepTheMarginOfTheRulesFromHitsOfWhatCanMove) {
  const Scan scan = denseHits();
  MapperConfig config = withMode("line");
  config.rules.enabled = true;
  SemanticMapper mapper(config, reference::tableWithDynamicClass());
  const auto voids = [&](double margin) {
    config.rules.void_margin = margin;
    mapper.reconfigure(config);
    return countVoids(scan, mapper, static_cast<float>(config.rules.emptiness()));
  };
  const std::size_t all = voids(0.0);
  EXPECT_GT(all, 0u);
  EXPECT_EQ(voids(0.9 * config.resolution), all) << "it is rounded down";
  EXPECT_LT(voids(2.0 * config.resolution), all);
  EXPECT_GT(voids(2.0 * config.resolution), 0u);
  EXPECT_EQ(voids(0.0), all);
}

INSTANTIATE_TEST_SUITE_P(Nasty, EveryScene, testing::Range<std::size_t>(0, reference::nastyScenes(1).size()));

}  // namespace
}  // namespace bki_mapping
