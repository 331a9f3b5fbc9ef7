// Distances from a beam and positions along it, as its line setup has them, are those of geometry.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "beams/raster/line_kernels.h"
#include "beams/raster/line_setup.h"
#include "simd/instruction_sets.h"

namespace bki_mapping {
namespace {

constexpr double kResolution = 0.3;

std::vector<Eigen::Vector3f> directions() {
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  std::vector<Eigen::Vector3f> all;
  for (int n = 0; n < 3000; ++n) {
    Eigen::Vector3f beam(normal(random), normal(random), n % 2 == 0 ? 0.1f * normal(random) : normal(random));
    all.push_back(20.0f * beam.normalized());
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0f, 1.0f}) all.emplace_back(7.0f * sign * Eigen::Vector3f::Unit(axis));
  }
  all.emplace_back(5.0f, 5.0f, 0.0f);
  all.emplace_back(-5.0f, 5.0f, 5.0f);
  return all;
}

/// The axes of a slice through the sensor, and the step to the next slice.
struct Basis {
  Eigen::Vector3d side, height, across;  ///< across: 1 from slice to slice

  explicit Basis(BeamSlicing slicing) {
    const Eigen::Vector3d main = Eigen::Vector3d::Unit(slicing.axis),
                          beside = Eigen::Vector3d::Unit(kSideAxis[slicing.axis]);
    height = Eigen::Vector3d::Unit(kHeightAxis[slicing.axis]);
    side = slicing.shear == 0 ? beside : Eigen::Vector3d(main - 2.0 * slicing.shear * beside);
    across = slicing.shear == 0 ? main : Eigen::Vector3d(2.0 * main + slicing.shear * beside);
  }
};

void expectSetupsAgreeWithGeometry(const LineKernels& kernels) {
  ThreadPool pool(2);
  const double unit = std::sqrt(static_cast<double>(kernels.kernel_scale));
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(-3.0, 3.0);
  const std::vector<Eigen::Vector3f> ends = directions();
  for (const double reach : {0.4, 1.0, 1.5, 4.0}) {  // [voxels]
    LineSetups setups;
    setups.set({{}, ends}, kResolution, reach * kResolution, kernels, pool);
    int sheared = 0, straights = 0;
    for (std::size_t b = 0; b < ends.size(); ++b) {
      const LineSetup line = setups.arrays().lines[b];
      const BeamSlicing slicing = BeamSlicing::of(line.slicing);
      ASSERT_EQ(slicing.number(), line.slicing);
      EXPECT_EQ(static_cast<float>(slicing.shear), setups.arrays().shear[b]);
      (slicing.shear == 0 ? straights : sheared) += 1;
      const Basis basis(slicing);
      const Eigen::Vector3d end = ends[b].cast<double>() / kResolution, u = end.normalized();
      // On the beam in slice 1, as the setup has it.
      Eigen::Vector3d at = u / u.dot(basis.across);
      EXPECT_NEAR(line.rho_slice, at.dot(u) / end.norm(), 1e-6);
      Eigen::Vector3d position = line.slope_height * basis.height;
      if (slicing.shear == 0) {
        position += basis.across + line.slope_side * basis.side;
      } else {
        position +=
            slicing.shear * Eigen::Vector3d::Unit(kSideAxis[slicing.axis]) + line.slope_side * basis.side;
      }
      EXPECT_LT((position - at).norm(), 1e-6);
      for (int n = 0; n < 10; ++n) {
        const double side = uniform(random), height = uniform(random);
        const Eigen::Vector3d p = side * basis.side + height * basis.height;
        const double distance = (p - p.dot(u) * u).norm() / reach * unit;
        const double e = side * line.e_side + height * line.e_height, g = height * line.g_height;
        EXPECT_NEAR(std::hypot(e, g), distance, unit * 5e-6 * (1.0 + 1.0 / reach)) << ends[b].transpose();
        EXPECT_NEAR(side * line.rho_side + height * line.rho_height, p.dot(u) / end.norm(), 1e-6);
        if (distance < unit * kReachThatCounts) {
          EXPECT_LE(std::abs(side), line.half_side + 1e-5f);
          EXPECT_LE(std::abs(height), line.half_height + 1e-5f);
        }
      }
    }
    EXPECT_EQ(sheared > 0, reach <= 1.0) << reach;
    EXPECT_EQ(straights > 0, reach > 1.0) << reach;
  }
}

TEST(LineSetups, AgreeWithGeometryOnEachInstructionSet) {
  for (const std::string& set : instructionSets()) {
    SCOPED_TRACE(set);
    expectSetupsAgreeWithGeometry(lineKernelsFor(set));
  }
}

}  // namespace
}  // namespace bki_mapping
