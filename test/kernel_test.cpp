// The kernel computed is the formula's, within its stated bound.
#include <gtest/gtest.h>

#include <cmath>

#include "bki_mapping/inference/kernel.h"
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

}  // namespace
}  // namespace bki_mapping
