// Near the sensor, where rules limit what a scan adds: full voxels are full, those left out are empty, and
// the sums of the others are those of brute force.
#include "beams/near_sensor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "reference/reference.h"
#include "reference/scenes.h"
#include "simd/instruction_sets.h"

namespace bki_mapping {
namespace {

constexpr double kResolution = 0.3;
constexpr float kEnough = 0.03f;

enum class Directions {
  kLidar,
  kAll,
  kShort,  ///< all; of sixteen beams, fifteen end beside the sensor, so that one in sixteen is all that there
           ///< is
};

/// Hits on the walls, floor and ceiling of a box about the sensor.
std::vector<Eigen::Vector3f> beamsInBox(int count, Directions directions) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> azimuth(-3.14159265, 3.14159265), sine(-1.0, 1.0),
      noise(-0.05, 0.05);
  const Eigen::Vector3d low(-3.5, -9.0, -1.6), high(14.0, 2.5, 4.0);
  std::vector<Eigen::Vector3f> ends;
  for (int n = 0; n < count; ++n) {
    const double z = directions == Directions::kLidar ? std::sin(0.03 - 0.45 * (n % 48) / 48.0)
                                                      : sine(random),
                 a = azimuth(random);
    const Eigen::Vector3d u(std::sqrt(1.0 - z * z) * std::cos(a), std::sqrt(1.0 - z * z) * std::sin(a), z);
    double length = 20.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double wall = u[axis] < 0.0 ? low[axis] : high[axis];
      if (std::abs(u[axis]) > 1e-9) length = std::min(length, wall / u[axis]);
    }
    // Something thin in front of the wall.
    if (n % 97 == 0) length *= 0.4;
    ends.emplace_back(((length + noise(random)) * u).cast<float>());
    for (int k = 1; k < 16 && directions == Directions::kShort; ++k)
      ends.emplace_back((0.05 * u).cast<float>());
  }
  return ends;
}

struct Sum {
  double value = 0.0;
  int beams = 0;  ///< that reach the voxel
};

/// Equations (6) and (7) of docs/method.md, with unit scale. Without Eigen, with which
/// this took half of the test, because tests are optimised little. @param voxel from the sensor [m].
Sum sumAt(const std::vector<Eigen::Vector3f>& ends, const Eigen::Vector3d& voxel, double length,
          BeamWeight weight) {
  Sum sum;
  const double vx = voxel.x(), vy = voxel.y(), vz = voxel.z();
  for (const Eigen::Vector3f& end : ends) {
    const float* const coordinates = end.data();
    const double x = coordinates[0], y = coordinates[1], z = coordinates[2];
    const double rho = (vx * x + vy * y + vz * z) / (x * x + y * y + z * z);
    if (!(rho > 0.0 && rho < 1.0)) continue;
    const double dx = vx - rho * x, dy = vy - rho * y, dz = vz - rho * z;
    const double d = std::sqrt(dx * dx + dy * dy + dz * dz);
    if (d >= length) continue;
    ++sum.beams;
    const double w = weight == BeamWeight::kUniform  ? 1.0
                     : weight == BeamWeight::kLinear ? rho
                                                     : std::min(rho, 1.0 - rho);
    sum.value += w * reference::sparseKernel(d, length, 1.0);
  }
  return sum;
}

struct Case {
  const char* name;
  int beams;
  Directions directions;
  double length;  ///< of the kernel [m]
  BeamWeight weight;
  BeamIndexType index;
};

class NearSensorTest : public testing::TestWithParam<Case> {};

TEST_P(NearSensorTest, FindsWhatBruteForceFinds) {
  const Case& c = GetParam();
  ThreadPool pool(2);
  const GridGeometry geometry(kResolution);
  KernelConfig kernel;
  kernel.length = c.length;
  kernel.scale = 1.0;
  BeamField field(geometry, kernel, c.index);
  const Beams beams = {{0.21, -0.34, 0.05}, beamsInBox(c.beams, c.directions)};
  field.setBeams(beams, pool);
  for (const std::string& set : instructionSets()) {
    const LineKernels& kernels = lineKernelsFor(set);
    LineSetups lines;
    lines.set(field.beams(), kResolution, field.reachMetres(), kernels, pool);
    NearSensor near(kernels);
    near.set(field, lines, c.weight, kEnough, pool);
    NearSensor::Workspace own;
    near.reserve(own);
    std::size_t full = 0, empty = 0, open = 0, faults = 0;
    for (int g = 0; g < 8; ++g) {
      const BlockGroup group = {{g % 2 - 1, g / 2 % 2 - 1, g / 4 - 1}, ~std::uint64_t{0}};
      std::vector<GroupBlock> blocks;
      for (int n = 0; n < kGroupBlocks; ++n) {
        blocks.emplace_back(BlockIndex{{group.index.x * kGroupEdge + n % kGroupEdge,
                                        group.index.y * kGroupEdge + n / kGroupEdge % kGroupEdge,
                                        group.index.z * kGroupEdge + n / (kGroupEdge * kGroupEdge)}},
                            0, nullptr, nullptr, nullptr);
      }
      NearBeams all;
      field.findRangesNear(group, all);
      near.start(group, blocks, all.ranges, own, [](std::size_t) { return VoxelMask(); });
      for (const GroupBlock& block : blocks) {
        if ((own.blocks >> slotInGroup(block.index) & 1) == 0) continue;
        float sums[kBlockVoxels];
        near.sumsOf(block.index, own, sums);
        const auto& voxels = own.voxels[static_cast<std::size_t>(slotInGroup(block.index))];
        for (int v = 3 * g; v < kBlockVoxels; v += 37) {
          const Eigen::Vector3d centre =
              geometry.voxelCentre(GridGeometry::voxelOf(block.index, v)) - beams.origin;
          const Sum truth = sumAt(beams.ends, centre, c.length, c.weight);
          const auto layer = static_cast<std::size_t>(v / 64);
          const double tolerance = 2e-5 + 2e-6 * truth.beams + 2e-5 * truth.value;
          if ((voxels.full[layer] >> v % 64 & 1) != 0) {
            ++full;
            faults += truth.value < kEnough || sums[v] < kEnough;
          } else if ((voxels.open[layer] >> v % 64 & 1) != 0) {
            ++open;
            faults += std::abs(sums[v] - truth.value) > tolerance;
          } else {
            ++empty;
            faults += truth.value > 1e-6 || sums[v] != 0.0f;
          }
        }
      }
    }
    EXPECT_EQ(faults, 0u) << set;
    // Each way is taken.
    EXPECT_GT(full, 60u) << set;
    EXPECT_GT(empty, 30u) << set;
    EXPECT_GT(open, 30u) << set;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Beams, NearSensorTest,
    testing::Values(
        Case{"lidar", 20000, Directions::kLidar, 0.3, BeamWeight::kBilinear, BeamIndexType::kTable},
        Case{"lidar_by_rtree", 20000, Directions::kLidar, 0.3, BeamWeight::kBilinear, BeamIndexType::kRtree},
        Case{"all_around", 30000, Directions::kAll, 0.3, BeamWeight::kBilinear, BeamIndexType::kTable},
        Case{"mostly_short", 4000, Directions::kShort, 0.3, BeamWeight::kBilinear, BeamIndexType::kTable},
        Case{"long_kernel", 20000, Directions::kLidar, 0.8, BeamWeight::kLinear, BeamIndexType::kTable},
        Case{"short_kernel", 30000, Directions::kAll, 0.2, BeamWeight::kUniform, BeamIndexType::kTable}),
    [](const auto& each) { return std::string(each.param.name); });

TEST(NearSensor, NothingIsNearWithoutALimit) {
  ThreadPool pool(1);
  const GridGeometry geometry(kResolution);
  KernelConfig kernel;
  BeamField field(geometry, kernel, BeamIndexType::kTable);
  field.setBeams({Eigen::Vector3d::Zero(), beamsInBox(20000, Directions::kLidar)}, pool);
  const LineKernels& kernels = lineKernelsFor("");
  LineSetups lines;
  lines.set(field.beams(), kResolution, field.reachMetres(), kernels, pool);
  NearSensor near(kernels);
  near.set(field, lines, BeamWeight::kBilinear, std::numeric_limits<float>::infinity(), pool);
  NearSensor::Workspace own;
  near.reserve(own);
  const BlockGroup group = {{0, 0, 0}, 1};
  const std::vector<GroupBlock> blocks = {{BlockIndex{{0, 0, 0}}, 0, nullptr, nullptr, nullptr}};
  NearBeams all;
  field.findRangesNear(group, all);
  near.start(group, blocks, all.ranges, own, [](std::size_t) { return VoxelMask(); });
  EXPECT_EQ(own.blocks, 0u);
}

Scan denseScan() {
  Scan scan;
  scan.origin = {0.21, -0.34, 0.05};
  scan.stamp = 7;
  scan.points = beamsInBox(15000, Directions::kLidar);
  for (std::size_t n = 0; n < scan.points.size(); ++n)
    scan.labels.push_back(10u * (scan.points[n].z() < -1.4f ? 1u : 2u));
  return scan;
}

MapperConfig robot() {
  MapperConfig config;
  config.free_space.mode = "line";
  config.downsample_resolution = 0.0;
  config.rules.enabled = true;
  config.sensor_model.height = 1.6;
  config.threads = 2;
  return config;
}

TEST(NearSensor, NeitherThreadsNorWithdrawnScansChangeABit) {
  const Scan scan = denseScan();
  Scan turned = scan;
  turned.origin += Eigen::Vector3d(0.4, 0.1, 0.0);
  turned.stamp = 1'000'000'000;
  std::unique_ptr<SemanticMapper> first;
  for (const int threads : {1, 2, 5}) {
    MapperConfig config = robot();
    config.threads = threads;
    config.rules.latest = false;  // looks cannot be withdrawn
    auto mapper = std::make_unique<SemanticMapper>(config, reference::tableWithDynamicClass());
    if (threads == 2) mapper->integrate(turned);
    mapper->integrate(scan);
    if (threads == 2) mapper->withdraw(turned);
    if (!first) {
      first = std::move(mapper);
      continue;
    }
    std::size_t planes = 0;
    ASSERT_EQ(mapper->map().size(), first->map().size());
    for (const auto& entry : first->map().entries()) {
      const Block* const block = mapper->map().find(entry.index);
      ASSERT_TRUE(block);
      ASSERT_EQ(block->classes(), entry.block->classes());
      for (std::size_t p = 0; p < block->classes().size(); ++p, ++planes) {
        EXPECT_TRUE(std::equal(block->plane(p), block->plane(p) + kBlockVoxels, entry.block->plane(p)));
      }
    }
    EXPECT_GT(planes, 100u);
  }
}

/// The whole way into the map, with the rules of the preset robot.
TEST(NearSensor, AMapOfADenseScanEqualsBruteForce) {
  const Scan scan = denseScan();
  const MapperConfig config = robot();
  const auto classes = reference::tableWithDynamicClass();
  SemanticMapper mapper(config, classes);
  mapper.integrate(scan);
  const reference::ScanReference brute(scan, *classes, config);
  const double scale = applied(config).kernel.scale;
  std::size_t faults = 0, some = 0, asked = 0;
  const auto ask = [&](const VoxelIndex& voxel) {
    const Block* const block = mapper.map().find(GridGeometry::blockOf(voxel));
    const EvidenceUnits* const plane = block ? block->evidence(kFreeClass) : nullptr;
    const reference::Value truth = brute.evidence(voxel, kFreeClass);
    const double got =
        plane ? static_cast<double>(evidenceOf(plane[GridGeometry::offsetInBlock(voxel)])) : 0.0;
    faults += std::abs(got - truth.sum) > truth.tolerance(scale);
    some += truth.sum > 0.0;
    ++asked;
  };
  for (const auto& entry : mapper.map().entries()) {
    for (int v = static_cast<int>(asked) % 61; v < kBlockVoxels; v += 61)
      ask(GridGeometry::voxelOf(entry.index, v));
  }
  EXPECT_GT(asked, 2 * some);
  // Also where the map has no block.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> along(0.0, 1.1);
  for (std::size_t n = 0; n < scan.points.size(); n += 40) {
    ask(mapper.map().geometry().voxelAt(scan.origin + along(random) * scan.points[n].cast<double>()));
  }
  EXPECT_EQ(faults, 0u);
  EXPECT_GT(some, 100u);
}

}  // namespace
}  // namespace bki_mapping
