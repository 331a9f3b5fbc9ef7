/// @file For tests of corrections: random motions, and scans of a room.
#pragma once

#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "bki_mapping/core/scan.h"
#include "journal/map_corrector.h"

namespace bki_mapping {

/// A motion by at most `metres` along each axis, and by at most `radians` about a random axis.
inline Eigen::Isometry3d randomMotion(std::mt19937& random, double metres, double radians) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto vector = [&] {
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    return Eigen::Vector3d(x, y, z);
  };
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = Eigen::AngleAxisd(radians * uniform(random), vector().normalized()).toRotationMatrix();
  motion.translation() = metres * vector();
  return motion;
}

/// A scan in a room: hits on its walls, and some anywhere.
inline Scan roomScan(const Eigen::Isometry3d& pose, std::uint64_t stamp, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Eigen::Vector3f> points;
  std::vector<std::uint32_t> labels;
  for (int n = 0; n < 60; ++n) {
    const double x = uniform(random), y = uniform(random), z = uniform(random);
    Eigen::Vector3d hit(6.0 * x, 4.0 * y, 1.5 * z);
    if (n % 5) hit[n % 3] = n % 2 ? 2.5 : -2.5;
    points.push_back((pose.inverse() * hit).cast<float>());
    labels.push_back(10 * (random() % 4));
  }
  return scanFromSensorFrame(pose, points, labels, stamp);
}

/// All scans move to where they belong, however near that is.
inline MapCorrector::Settings exactSettings() {
  MapCorrector::Settings settings;
  settings.tolerance = 0.0;
  return settings;
}

}  // namespace bki_mapping
