// Sums are limited and searched as a plain loop would, on every instruction set.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "rules/limit_kernels.h"
#include "simd/instruction_sets.h"

namespace bki_mapping {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kLayer = kBlockEdge * kBlockEdge;

TEST(LimitKernels, LimitAndFindAsAPlainLoopDoes) {
  std::mt19937 random(11);
  const float nan = std::numeric_limits<float>::quiet_NaN(), tiny = std::numeric_limits<float>::denorm_min();
  const float some[] = {0.0f, tiny, 0.001f, 0.0015f, 0.0016f, 0.002f, 0.3f, kInfinity, nan};
  for (int n = 0; n < 200; ++n) {
    std::vector<float> sums;
    for (int v = 0; v < kBlockVoxels; ++v) sums.push_back(some[random() % std::size(some)]);
    const std::uint64_t below = std::uint64_t{random()} << 32 | random();
    const float threshold = n % 3 == 0 ? 0.0f : 0.0005f, most = n % 5 == 0 ? kInfinity : 0.0015f;
    std::vector<float> limited;
    std::uint64_t reached[kBlockEdge] = {}, found[kBlockEdge] = {};
    const float least = some[1 + n % 7];
    const int first = n % kBlockEdge, last = first + 1 + n % (kBlockEdge - first);
    for (int v = 0; v < kBlockVoxels; ++v) {
      const float sum = sums[static_cast<std::size_t>(v)];
      float kept = sum - threshold < 0.0f ? 0.0f : sum - threshold;
      const bool above_reached =
          v >= kLayer ? sums[static_cast<std::size_t>(v - kLayer)] >= most : (below >> v & 1) != 0;
      if (above_reached) kept = sum;
      if (kept > most) kept = most;
      limited.push_back(kept);
      const std::uint64_t bit = std::uint64_t{1} << v % kLayer;
      if (sum >= most) reached[v / kLayer] |= bit;
      if (v / kLayer >= first && v / kLayer < last && sum >= least) found[v / kLayer] |= bit;
    }
    for (const std::string& set : instructionSets()) {
      const LimitKernels& kernels = limitKernelsFor(set);
      std::uint64_t got_found[kBlockEdge] = {}, got_reached[kBlockEdge] = {};
      kernels.find(sums.data(), {first, last}, least, got_found);
      std::vector<float> got = sums;
      kernels.limit(threshold, most, below, got.data(), got_reached);
      for (std::size_t v = 0; v < kBlockVoxels; ++v) {
        ASSERT_TRUE(got[v] == limited[v] || (std::isnan(got[v]) && std::isnan(limited[v])))
            << set << ' ' << v;
      }
      EXPECT_TRUE(std::equal(found, found + kBlockEdge, got_found)) << set << ", case " << n;
      EXPECT_TRUE(std::equal(reached, reached + kBlockEdge, got_reached)) << set << ", case " << n;
    }
  }
}

}  // namespace
}  // namespace bki_mapping
