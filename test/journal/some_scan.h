/// @file A scan for tests of journals.
#pragma once

#include <random>

#include "bki_mapping/core/scan.h"
#include "journal/random_motion.h"

namespace bki_mapping {

constexpr double kQuantum = 0.01;

inline Eigen::Isometry3d somePose(unsigned seed) {
  std::mt19937 random(seed);
  return randomMotion(random, 50.0, 3.0);
}

/// A scan with hits, some of which no map can hold, in the axes of the map.
inline Scan someScan(const Eigen::Isometry3d& pose, unsigned seed, bool soft) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-40.0f, 40.0f);
  std::vector<Eigen::Vector3f> points;
  for (int n = 0; n < 500; ++n) {
    const float x = uniform(random), y = uniform(random), z = uniform(random);
    points.emplace_back(x, y, z);
  }
  std::vector<std::uint32_t> labels;
  for (std::size_t n = 0; n < points.size(); ++n)
    labels.push_back(static_cast<std::uint32_t>(n % 3 + (n % 7 << 16)));
  Scan scan = scanFromSensorFrame(pose, points, labels, 123456789012345);
  if (soft) {
    scan.labels_are_ids = true;
    for (std::size_t n = 0; n < points.size(); ++n) {
      scan.soft.startPoint();
      for (std::size_t c = 0; c < n % 4; ++c)
        scan.soft.add({static_cast<ClassId>(c), 1.0f / static_cast<float>(n % 4)});
    }
  }
  for (int n = 0; n < 20; ++n) scan.no_returns.emplace_back(uniform(random), uniform(random), 1.0f);
  scan.no_returns.emplace_back(0.0f, 0.0f, 0.0f);
  return scan;
}

}  // namespace bki_mapping
