// The kernel computed is the formula's, within its stated bound.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "kernel/kernel_table.h"
#include "kernel/sparse_kernel.h"
#include "reference/reference.h"

namespace bki_mapping {
namespace {

TEST(Kernel, IsWithinItsBoundOfTheFormula) {
  for (int i = 0; i <= 200000; ++i) {
    const double r = i / 100000.0;
    ASSERT_NEAR(sparseKernel(static_cast<float>(r * r)), reference::sparseKernel(r, 1.0, 1.0), 1e-6)
        << "r = " << r;
  }
}

TEST(Kernel, IsOneAtTheCentreAndNothingAtTheEdge) {
  EXPECT_NEAR(sparseKernel(0.0f), 1.0f, 1e-6f);
  for (const float t : {1.0f, 1.0000001f, 2.0f, 1e9f}) EXPECT_EQ(sparseKernel(t), 0.0f) << t;
}

TEST(Kernel, NeverNegativeAndFallsWithDistance) {
  float last = 1.1f;
  for (int i = 0; i <= 10000; ++i) {
    const float value = sparseKernel(static_cast<float>(i) * 1e-4f);
    ASSERT_GE(value, 0.0f);
    ASSERT_LE(value, last + 2e-7f);
    last = value;
  }
}

/// What vector instructions compute from the table, one at a time.
float fromTable(float t) {
  const KernelTable& table = kernelTable();
  t = std::min(t, static_cast<float>(KernelTable::kPieces - 1));
  const auto piece = static_cast<std::size_t>(std::max(0.0f, std::nearbyint(t)));
  const auto c = [&](int power) { return table.c[power][piece]; };
  return std::fma(t, std::fma(t, std::fma(t, c(3), c(2)), c(1)), c(0));
}

float tablePlaceOf(double r) {
  return static_cast<float>(KernelTable::kScale * r * r + KernelTable::kShift);
}

TEST(KernelTable, IsWithinItsBoundOfTheFormula) {
  for (int i = 0; i <= 400000; ++i) {
    const double r = i / 200000.0;
    ASSERT_NEAR(fromTable(tablePlaceOf(r)), reference::sparseKernel(r, 1.0, 1.0), 1e-6) << "r = " << r;
  }
}

TEST(KernelTable, IsNothingAtTheEdgeAndHardlyBelowNothingBeforeIt) {
  for (const double r : {1.0, 1.0000001, 2.0, 1e6}) EXPECT_EQ(fromTable(tablePlaceOf(r)), 0.0f) << r;
  for (int i = 0; i <= 100000; ++i) ASSERT_GE(fromTable(tablePlaceOf(i * 1e-5)), -1e-8f) << i;
}

TEST(VoxelKernel, ReachesUpTo72VoxelsUnlessItCounts) {
  KernelConfig config;
  config.length = 7.2;
  EXPECT_FLOAT_EQ(VoxelKernel(config, 0.1).reach, 72.0f);
  config.length = 7.21;
  EXPECT_THROW(VoxelKernel(config, 0.1), std::invalid_argument);
  config.type = KernelType::kCounting;  // has no length
  EXPECT_NO_THROW(VoxelKernel(config, 0.1));
}

}  // namespace
}  // namespace bki_mapping
