// Random free samples have the right distribution and depend on all of their keys.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "free_space/random_distance.h"
#include "parallel/counter_random.h"

namespace bki_mapping {
namespace {

/// The Kolmogorov-Smirnov statistic of values against the uniform distribution on [0, 1].
double distanceFromUniform(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  double greatest = 0.0;
  const auto n = static_cast<double>(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    greatest = std::max({greatest, std::abs(values[i] - static_cast<double>(i) / n),
                         std::abs(values[i] - static_cast<double>(i + 1) / n)});
  }
  return greatest;
}

/// Critical value of the statistic at significance level 0.001 for n values: sqrt(-ln(0.0005) / (2 n)).
double criticalDistance(double n) {
  return std::sqrt(-std::log(0.0005) / 2.0 / n);
}

std::vector<double> squaredFractions(double (*distance)(double, double)) {
  std::vector<double> fractions;
  for (std::uint64_t beam = 0; beam < 20000; ++beam) {
    const double length = 1.0 + static_cast<double>(beam % 50);
    fractions.push_back(std::pow(distance(counterRandom(1, 42, beam, 0), length) / length, 2));
  }
  return fractions;
}

TEST(LinearSamples, AreEquallyDenseAllOverThePlane) {  // Theorem 1: (r / d)^2 is uniform
  EXPECT_LT(distanceFromUniform(squaredFractions(linearDistance)), criticalDistance(20000));
}

TEST(UniformSamples, CrowdNearTheSensor) {
  EXPECT_GT(distanceFromUniform(squaredFractions(uniformDistance)), 10 * criticalDistance(20000));
}

TEST(CounterRandom, IsUniformAndDependsOnEveryKey) {
  std::vector<double> values;
  for (std::uint64_t sample = 0; sample < 20000; ++sample) values.push_back(counterRandom(7, 8, 9, sample));
  EXPECT_LT(distanceFromUniform(values), criticalDistance(20000));
  const std::set<double> different = {counterRandom(1, 2, 3, 4), counterRandom(2, 2, 3, 4),
                                      counterRandom(1, 3, 3, 4), counterRandom(1, 2, 4, 4),
                                      counterRandom(1, 2, 3, 5)};
  EXPECT_EQ(different.size(), 5u);
  EXPECT_EQ(counterRandom(1, 2, 3, 4), counterRandom(1, 2, 3, 4));
}

}  // namespace
}  // namespace bki_mapping
