/// @file Wrong poses, to measure how well a map copes with them.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

namespace bki_mapping {

/// Adds errors to poses: of equal size along and about each axis of the sensor, normally distributed.
class PoseNoise {
 public:
  enum class Kind {
    kWhite,  ///< each pose is wrong by itself
    kDrift,  ///< each step from pose to pose is wrong, as in odometry, so that errors add up
  };

  /// @param position, angle standard deviations [m, rad].
  PoseNoise(Kind kind, double position, double angle, std::uint64_t seed)
      : kind_(kind), position_(position), angle_(angle), seed_(seed) {}

  /// The next pose with its error. The first pose does not drift.
  Eigen::Isometry3d next(const Eigen::Isometry3d& T_map_sensor);

 private:
  Eigen::Isometry3d error() const;

  Kind kind_;
  double position_, angle_;
  std::uint64_t seed_, count_ = 0;
  Eigen::Isometry3d last_true_ = Eigen::Isometry3d::Identity(), last_noisy_ = Eigen::Isometry3d::Identity();
};

}  // namespace bki_mapping
