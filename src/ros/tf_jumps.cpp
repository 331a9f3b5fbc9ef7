#include "ros/tf_jumps.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "bki_mapping/core/named_parameter.h"
#include "core/frame_name.h"
#include "ros/pose_conversion.h"

namespace bki_mapping::ros_interface {
namespace {

constexpr double kDegrees = 180.0 / 3.14159265358979323846;
/// Velocities change by this much while transforms are missing [m/s^2, degrees/s^2].
constexpr double kAcceleration = 2.0, kAngularAcceleration = 60.0;
/// The stamps of transforms are this inexact, as a fraction of the time between them.
constexpr double kStampNoise = 0.25;

/// The velocity of the sensor in a step [m/s], and that of its rotation [degrees/s].
struct Velocity {
  Eigen::Vector3d linear, angular;
};

}  // namespace

std::string sentenceOf(const TfJump& jump) {
  char numbers[200];
  std::snprintf(numbers, sizeof numbers,
                " moved the sensor by %.2f m and turned it by %.1f degrees at once at time %.3f, ",
                jump.distance, jump.angle, jump.stamp.toSec());
  return "tf jumped: the transform from '" + shortText(jump.parent) + "' to '" + shortText(jump.child) + "'" +
         numbers +
         "as when a loop closes. The map keeps what was mapped before, so that walls may be doubled";
}

bool TfJumpWatch::watch(const std::string& child, const Eigen::Vector3d& sensor) {
  if (const auto known = edges_.find(child); known != edges_.end()) {
    if (sensor.norm() > known->second.sensor.norm()) known->second.sensor = sensor;
    return false;
  }
  if (edges_.size() >= kMostFrames) return false;
  edges_[child].sensor = sensor;
  return true;
}

void TfJumpWatch::add(const geometry_msgs::TransformStamped& transform) {
  const auto found = edges_.find(frameName(transform.child_frame_id));
  if (found == edges_.end()) return;
  Edge& edge = found->second;
  const std::string parent = frameName(transform.header.frame_id);
  if (parent != edge.parent) edge.samples.clear();
  edge.parent = parent;
  if (!edge.samples.empty() && transform.header.stamp <= edge.samples.back().stamp) return;
  edge.samples.push_back({transform.header.stamp, toIsometry(transform.transform)});
  if (edge.samples.size() > kSteps + 3) edge.samples.pop_front();
  judge(found->first, edge);
}

void TfJumpWatch::judge(const std::string& child, const Edge& edge) {
  const std::deque<Sample>& samples = edge.samples;
  if (samples.size() < 4) return;  // a step before, the step, and one after it
  const auto duration = [&](std::size_t n) {
    return samples[n].stamp.toSec() - samples[n - 1].stamp.toSec();
  };
  const auto velocity = [&](std::size_t n) -> Velocity {  // of the step to sample n
    const Eigen::Isometry3d &before = samples[n - 1].T_parent_child, &after = samples[n].T_parent_child;
    const Eigen::AngleAxisd turn(after.linear() * before.linear().transpose());
    return {(after * edge.sensor - before * edge.sensor) / duration(n),
            kDegrees * turn.angle() * turn.axis() / duration(n)};
  };
  const std::size_t step = samples.size() - 2;
  const double time = duration(step);
  const Velocity now = velocity(step);
  double distance = 0.0, angle = 0.0, fastest = 0.0, fastest_turn = 0.0;
  for (const std::size_t beside : {step - 1, step + 1}) {  // the change to the neighbour that explains more
    const Velocity other = velocity(beside);
    const double moved = time * (now.linear - other.linear).norm();
    const double turned = time * (now.angular - other.angular).norm();
    distance = beside < step ? moved : std::min(distance, moved);
    angle = beside < step ? turned : std::min(angle, turned);
  }
  for (std::size_t n = 1; n < samples.size(); ++n) {
    if (n == step) continue;
    fastest = std::max(fastest, velocity(n).linear.norm());
    fastest_turn = std::max(fastest_turn, velocity(n).angular.norm());
  }
  const double gap = time * time;
  const bool jumped = distance > kLeastDistance + kStampNoise * fastest * time + kAcceleration * gap ||
                      angle > kLeastAngle + fastest_turn * time + kAngularAcceleration * gap;
  if (jumped) jumps_.push_back({edge.parent, child, samples[step].stamp, distance, angle});
}

std::vector<TfJump> TfJumpWatch::take() {
  std::vector<TfJump> taken;
  taken.swap(jumps_);
  return taken;
}

}  // namespace bki_mapping::ros_interface
