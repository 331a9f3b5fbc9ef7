/// @file Random motions for tests of corrections.
#pragma once

#include <Eigen/Geometry>
#include <random>

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

}  // namespace bki_mapping
