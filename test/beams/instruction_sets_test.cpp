// The law on every instruction set that this processor has: each is forced in turn.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <random>

#include "beams/line_evidence.h"
#include "points/point_evidence.h"
#include "reference/reference.h"
#include "reference/scenes.h"
#include "simd/instruction_sets.h"
#include "update/map_updater.h"

namespace bki_mapping {
namespace {

/// Voxels of the map whose evidence for a class is not the brute-force sum.
/// @param room for the kernel's stated bound, where very many beams add up.
std::size_t faultsOf(const SemanticMap& map, const reference::ScanReference& brute, ClassId id,
                     const MapperConfig& config, double room = 0.0) {
  std::size_t faults = 0;
  for (const auto& entry : map.entries()) {
    const EvidenceUnits* plane = entry.block->evidence(id);
    for (int v = 0; v < kBlockVoxels; ++v) {
      const reference::Value truth = brute.evidence(GridGeometry::voxelOf(entry.index, v), id);
      const double tolerance = truth.tolerance(config.kernel.scale) + room;
      const EvidenceUnits got = plane ? plane[v] : 0;
      faults += std::abs(static_cast<double>(evidenceOf(got)) - truth.sum) > tolerance || got < 0;
    }
  }
  return faults;
}

TEST(InstructionSets, GenericIsAlwaysThere) {
  EXPECT_EQ(instructionSets().front(), "generic");
  EXPECT_THROW(instructionSetFor("abacus"), std::invalid_argument);
  EXPECT_THROW(lineKernelsFor("abacus"), std::invalid_argument);
  EXPECT_THROW(pointKernelsFor("abacus"), std::invalid_argument);
  EXPECT_EQ(lineKernelsFor("").instruction_set, instructionSets().back());
  EXPECT_EQ(pointKernelsFor("").instruction_set, instructionSets().back());
  const char* const fastest = std::getenv(kInstructionSetVariable);
  if (fastest && *fastest != '\0') {
    EXPECT_EQ(instructionSets().back(), fastest);
  }
  for (const std::string& set : instructionSets()) {
    EXPECT_EQ(lineKernelsFor(set).instruction_set, set);
    EXPECT_EQ(pointKernelsFor(set).instruction_set, set);
  }
}

TEST(InstructionSets, LinesEqualBruteForceOnEach) {
  ThreadPool pool(2);
  for (const std::string& set : instructionSets()) {
    for (const reference::Scene& scene : reference::nastyScenes(60)) {
      for (const BeamWeight weight : {BeamWeight::kUniform, BeamWeight::kLinear, BeamWeight::kBilinear}) {
        for (const BeamIndexType index : {BeamIndexType::kTable, BeamIndexType::kRtree}) {
          MapperConfig config;
          config.downsample_resolution = 0.0;
          config.free_space.weight = weight;
          const GridGeometry geometry(config.resolution);
          BeamField field(geometry, config.kernel, index);
          field.setBeams({scene.scan.origin, scene.scan.points}, pool);
          LineEvidence evidence(weight, FreeSpaceExtent::kObserved, set);
          evidence.setField(field, pool);
          SemanticMap map(geometry, config.prior, 4);
          MapUpdater().update(map, {nullptr, &evidence}, pool);
          ASSERT_GT(map.size(), 0u);
          const reference::ScanReference brute(scene.scan, *reference::smallTable(), config);
          EXPECT_EQ(faultsOf(map, brute, kFreeClass, config), 0u) << set << ", " << scene.name;
        }
      }
    }
  }
}

/// Kernels of all lengths: below, at and above a voxel, and the longest.
TEST(InstructionSets, LinesOfAnyKernelEqualBruteForceOnEach) {
  struct Size {
    double resolution, length;
    int beams;
  };
  ThreadPool pool(2);
  for (const Size& size : {Size{0.3, 0.1, 60}, Size{0.3, 0.4, 60}, Size{0.3, 0.43, 60}, Size{0.3, 0.57, 60},
                           Size{0.1, 0.3, 40}, Size{0.2, 1.5, 20}, Size{0.04, 2.88, 1}}) {
    std::size_t blocks = 0;
    for (const reference::Scene& scene : reference::nastyScenes(size.beams)) {
      MapperConfig config;
      config.resolution = size.resolution;
      config.kernel.length = size.length;
      config.downsample_resolution = 0.0;
      config.free_space.weight = BeamWeight::kLinear;
      if (size.beams == 1 && (scene.scan.points.empty() || scene.scan.points[0].norm() > 3.0f))
        continue;  // takes long
      const reference::ScanReference brute(scene.scan, *reference::smallTable(), config);
      const GridGeometry geometry(config.resolution);
      BeamField field(geometry, config.kernel, BeamIndexType::kTable);
      field.setBeams({scene.scan.origin, scene.scan.points}, pool);
      for (const std::string& set : instructionSets()) {
        LineEvidence evidence(BeamWeight::kLinear, FreeSpaceExtent::kObserved, set);
        evidence.setField(field, pool);
        SemanticMap map(geometry, config.prior, 4);
        MapUpdater().update(map, {nullptr, &evidence}, pool);
        blocks += map.size();
        EXPECT_EQ(faultsOf(map, brute, kFreeClass, config), 0u)
            << set << ", " << scene.name << ", " << size.length << " m in voxels of " << size.resolution
            << " m";
      }
    }
    EXPECT_GT(blocks, 0u) << size.length;
  }
}

/// So far from the sensor single precision does not tell voxels apart.
TEST(InstructionSets, LinesFarFromTheSensorEqualBruteForceOnEach) {
  ThreadPool pool(2);
  for (const Eigen::Vector3f& far :
       {Eigen::Vector3f(6e6f, 4e6f, -1e6f), Eigen::Vector3f(-2e6f, 8e6f, 7e6f)}) {
    const reference::Scene scene =
        reference::makeScene("far", {0.3, -0.2, 0.1}, 200, 4, [&](std::mt19937& random) {
          std::uniform_int_distribution<int> halves(-16, 16);
          const Eigen::Vector3d aside(halves(random), halves(random), halves(random));
          return Eigen::Vector3d(far.cast<double>() + 0.5 * aside);
        });
    MapperConfig config;
    config.downsample_resolution = 0.0;
    config.sensor_model.max_range = 1e7;
    config.free_space.weight = BeamWeight::kUniform;
    const reference::ScanReference brute(scene.scan, *reference::smallTable(), config);
    const GridGeometry geometry(config.resolution);
    BeamField field(geometry, config.kernel, BeamIndexType::kTable);
    field.setBeams({scene.scan.origin, scene.scan.points}, pool);
    const BlockIndex middle =
        GridGeometry::blockOf(geometry.voxelAt(scene.scan.origin + 0.5 * far.cast<double>()));
    for (const std::string& set : instructionSets()) {
      LineEvidence evidence(BeamWeight::kUniform, FreeSpaceExtent::kMapped, set);
      evidence.setField(field, pool);
      SemanticMap map(geometry, config.prior, 4);
      for (int n = 0; n < 27; ++n) {
        map.getOrAllocate({{middle.x + n % 3 - 1, middle.y + n / 3 % 3 - 1, middle.z + n / 9 - 1}});
      }
      MapUpdater().update(map, {nullptr, &evidence}, pool);
      ASSERT_GT(map.size(), 0u) << set;  // those without evidence are not kept
      EXPECT_EQ(faultsOf(map, brute, kFreeClass, config), 0u) << set;
    }
  }
}

TEST(InstructionSets, BeamsWithoutLengthReachNothing) {
  ThreadPool pool(1);
  const MapperConfig config;
  const GridGeometry geometry(config.resolution);
  const Eigen::Vector3d origin(0.1, 0.2, 0.05);
  const Eigen::Vector3f beam(1.0f, 0.5f, 0.2f);
  for (const std::string& set : instructionSets()) {
    const auto mapOf = [&](const std::vector<Eigen::Vector3f>& ends) {
      BeamField field(geometry, config.kernel, BeamIndexType::kTable);
      field.setBeams({origin, ends}, pool);
      LineEvidence evidence(BeamWeight::kUniform, FreeSpaceExtent::kObserved, set);
      evidence.setField(field, pool);
      auto map = std::make_unique<SemanticMap>(geometry, config.prior, 4);
      MapUpdater().update(*map, {nullptr, &evidence}, pool);
      return map;
    };
    const auto with = mapOf({Eigen::Vector3f::Zero(), beam}), without = mapOf({beam});
    ASSERT_GT(without->size(), 0u);
    ASSERT_EQ(with->size(), without->size()) << set;
    for (const auto& entry : without->entries()) {
      const Block* same = with->find(entry.index);
      ASSERT_NE(same, nullptr) << set;
      const EvidenceUnits *sums = entry.block->evidence(kFreeClass), *others = same->evidence(kFreeClass);
      EXPECT_TRUE(std::equal(sums, sums + kBlockVoxels, others)) << set;
    }
  }
}

TEST(InstructionSets, NoSumOfABeamIsBelowZero) {
  ThreadPool pool(1);
  MapperConfig config;
  const GridGeometry geometry(config.resolution);
  BeamField field(geometry, config.kernel, BeamIndexType::kTable);
  std::mt19937 random(11);
  std::uniform_real_distribution<float> anywhere(-9.0f, 9.0f);
  for (const std::string& set : instructionSets()) {
    LineEvidence evidence(BeamWeight::kUniform, FreeSpaceExtent::kObserved, set);
    for (int n = 0; n < 200; ++n) {
      field.setBeams({{0.1, 0.2, 0.05}, {{anywhere(random), anywhere(random), anywhere(random)}}}, pool);
      evidence.setField(field, pool);
      SemanticMap map(geometry, config.prior, 4);
      MapUpdater().update(map, {nullptr, &evidence}, pool);
      for (const auto& entry : map.entries()) {
        const EvidenceUnits* plane = entry.block->evidence(kFreeClass);
        ASSERT_GE(*std::min_element(plane, plane + kBlockVoxels), 0) << set << ", beam " << n;
      }
    }
  }
}

/// So many beams that rounding of sums matters.
void expectLinesOfManyBeams(const reference::Scene& scene, BeamWeight weight, BeamIndexType index) {
  ThreadPool pool(2);
  MapperConfig config;
  config.downsample_resolution = 0.0;
  config.free_space.weight = weight;
  const reference::ScanReference brute(scene.scan, *reference::smallTable(), config);
  const GridGeometry geometry(config.resolution);
  BeamField field(geometry, config.kernel, index);
  field.setBeams({scene.scan.origin, scene.scan.points}, pool);
  for (const std::string& set : instructionSets()) {
    LineEvidence evidence(weight, FreeSpaceExtent::kObserved, set);
    evidence.setField(field, pool);
    SemanticMap map(geometry, config.prior, 4);
    MapUpdater().update(map, {nullptr, &evidence}, pool);
    ASSERT_GT(map.size(), 0u);
    // Kernel values are right to 1e-6 of their scale: far less than one beam's own value.
    const double room = 1e-6 * config.kernel.scale * static_cast<double>(scene.scan.points.size());
    EXPECT_EQ(faultsOf(map, brute, kFreeClass, config, room), 0u) << set << ", " << scene.name;
  }
}

TEST(InstructionSets, ManyBeamsInAPlaceEqualBruteForceOnEach) {
  const reference::Scene scene =
      reference::makeScene("bundle", {0.3, -0.2, 0.1}, 3000, 4, [](std::mt19937& random) {
        std::uniform_real_distribution<double> aside(-0.1, 0.1), along(1.0, 2.0);
        return Eigen::Vector3d(along(random), aside(random), aside(random));
      });
  for (const BeamIndexType index : {BeamIndexType::kTable, BeamIndexType::kRtree}) {
    expectLinesOfManyBeams(scene, BeamWeight::kBilinear, index);
  }
}

TEST(InstructionSets, ManyBeamsAllAroundEqualBruteForceOnEach) {
  const reference::Scene scene =
      reference::makeScene("all around", {0.3, -0.2, 0.1}, 5000, 4, [](std::mt19937& random) {
        std::normal_distribution<double> any;
        std::uniform_real_distribution<double> along(0.5, 1.5);
        return Eigen::Vector3d(Eigen::Vector3d(any(random), any(random), any(random)).normalized() *
                               along(random));
      });
  for (const BeamWeight weight : {BeamWeight::kUniform, BeamWeight::kLinear, BeamWeight::kBilinear}) {
    expectLinesOfManyBeams(scene, weight, BeamIndexType::kTable);
  }
}

/// A scene's points as evidence; with soft labels once for each class, weighted by its share.
MergedPoints pointsOf(const Scan& scan) {
  MergedPoints points;
  const auto add = [&](const Eigen::Vector3f& point, ClassId label) {
    points.x.push_back(point.x());
    points.y.push_back(point.y());
    points.z.push_back(point.z());
    points.labels.push_back(label);
  };
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (scan.soft.empty()) {
      add(scan.points[i], static_cast<ClassId>(scan.labels[i] / 10));
      continue;
    }
    for (const ClassShare* share = scan.soft.begin(i); share != scan.soft.end(i); ++share) {
      add(scan.points[i], share->id);
      points.weights.push_back(share->share);
    }
  }
  return points;
}

void expectPointsEqualBruteForce(const reference::Scene& scene) {
  ThreadPool pool(2);
  const MergedPoints points = pointsOf(scene.scan);
  for (const std::string& set : instructionSets()) {
    for (const auto& [length, spreads] :
         {std::pair(0.2, true), {0.3, true}, {0.5, true}, {1.0, true}, {0.2, false}, {0.5, false}}) {
      MapperConfig config;
      config.downsample_resolution = 0.0;
      config.kernel.length = length;  // below, at and above a voxel
      config.scan_rules.static_spread = spreads;
      const ClassSet confined = spreads ? 0b0000 : 0b1110;
      PointEvidence evidence(GridGeometry(config.resolution), config.kernel, false, confined, set);
      evidence.setPoints(scene.scan.origin, {&points}, pool);
      SemanticMap map(GridGeometry(config.resolution), config.prior, 4);
      MapUpdater().update(map, {&evidence}, pool);
      ASSERT_GT(map.size(), 0u);
      const reference::ScanReference brute(scene.scan, *reference::smallTable(), config);
      for (ClassId id = 0; id < 4; ++id) {
        EXPECT_EQ(faultsOf(map, brute, id, config), 0u) << set << ", " << scene.name << ", length " << length;
      }
    }
  }
}

TEST(InstructionSets, PointsEqualBruteForceOnEach) {
  for (const reference::Scene& scene : reference::nastyScenes(300)) expectPointsEqualBruteForce(scene);
}

TEST(InstructionSets, WeightedPointsEqualBruteForceOnEach) {
  for (reference::Scene scene : reference::nastyScenes(300)) {
    scene.scan.labels_are_ids = true;
    for (std::size_t i = 0; i < scene.scan.points.size(); ++i) {
      const auto share = static_cast<float>(i % 97 + 1) / 100.0f;
      scene.scan.labels[i] = share > 0.5f ? 1 : 3;
      scene.scan.soft.startPoint();
      scene.scan.soft.add({1, share});
      scene.scan.soft.add({3, 1.0f - share});
    }
    scene.name += ", soft labels";
    expectPointsEqualBruteForce(scene);
  }
}

}  // namespace
}  // namespace bki_mapping
