#include "evaluation/pose_noise.h"

#include "parallel/counter_random.h"

namespace bki_mapping {

Eigen::Isometry3d PoseNoise::error() const {
  const auto normal = [&](std::uint64_t axis) { return counterNormal(seed_, count_, axis); };
  const Eigen::Vector3d turn = angle_ * Eigen::Vector3d(normal(3), normal(4), normal(5));
  Eigen::Isometry3d error = Eigen::Isometry3d::Identity();
  error.translation() = position_ * Eigen::Vector3d(normal(0), normal(1), normal(2));
  if (!turn.isZero()) error.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix();
  return error;
}

Eigen::Isometry3d PoseNoise::next(const Eigen::Isometry3d& T_map_sensor) {
  Eigen::Isometry3d noisy = T_map_sensor * error();
  if (kind_ == Kind::kDrift) {
    noisy = count_ == 0 ? T_map_sensor : last_noisy_ * (last_true_.inverse() * T_map_sensor) * error();
  }
  ++count_;
  last_true_ = T_map_sensor;
  last_noisy_ = noisy;
  return noisy;
}

}  // namespace bki_mapping
