#include "ros/corrected_poses.h"

#include <ros/console.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "core/counted.h"
#include "core/frame_name.h"
#include "ros/pose_conversion.h"

namespace bki_mapping::ros_interface {
namespace {

/// A pose that a robot can have.
bool isPose(const geometry_msgs::Pose& pose) {
  const auto& [x, y, z, w] =
      std::tie(pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w);
  const double norm = x * x + y * y + z * z + w * w;
  return std::isfinite(pose.position.x) && std::isfinite(pose.position.y) && std::isfinite(pose.position.z) &&
         std::abs(norm - 1.0) < 0.01;
}

}  // namespace

CorrectedPoses::CorrectedPoses(ros::NodeHandle& node, const ServerConfig& config, const PoseSource& poses,
                               MapCorrector& corrector, std::function<void()> on_path)
    : map_frame_(frameName(config.frame_id)),
      corrected_frame_(config.correction.corrected_frame_id),
      poses_(poses),
      odometry_(config.correction.odometry_frame_id, poses),
      corrector_(corrector),
      on_path_(std::move(on_path)),
      subscriber_(node.subscribe("corrected_path", 1, &CorrectedPoses::onPath, this)) {
  ROS_INFO("Scans are kept; the map follows the poses of %s", subscriber_.getTopic().c_str());
}

std::size_t CorrectedPoses::numberOf(const std::string& sensor_frame) {
  const auto known = std::find(sensor_frames_.begin(), sensor_frames_.end(), sensor_frame);
  const auto number = static_cast<std::size_t>(known - sensor_frames_.begin());
  if (known == sensor_frames_.end()) sensor_frames_.push_back(sensor_frame);
  return number;
}

void CorrectedPoses::add(SensorScan scan, const Eigen::Isometry3d& T_map_sensor,
                         const std::string& sensor_frame, const std::vector<GridIndex>& touched) {
  const OdometryPoses::Pose odometry = odometry_.of(sensor_frame, scan.stamp, T_map_sensor);
  if (odometry.is_first) corrector_.noteJump(scan.stamp);
  if (!odometry.warning.empty() && throttle_.allow(odometry.warning, SentenceThrottle::Clock::now())) {
    ROS_WARN("%s", odometry.warning.c_str());
  }
  corrector_.addScan(std::move(scan), numberOf(sensor_frame), T_map_sensor, odometry.T_odometry_sensor,
                     touched);
  if (said_forgotten_ || corrector_.progress().forgotten == 0) return;
  said_forgotten_ = true;
  ROS_WARN(
      "journal_limit is reached: the oldest scans are forgotten, and stay in the map where they are; raise "
      "journal_limit or journal_quantum, or publish fewer clouds");
}

void CorrectedPoses::noteJump(const ros::Time& stamp) {
  if (odometry_.isMapFrame()) corrector_.noteJump(stamp.toNSec());
}

std::vector<StampedMotion> CorrectedPoses::keyframesOf(const nav_msgs::Path& path) const {
  if (frameName(path.header.frame_id) != map_frame_) {
    throw std::invalid_argument("its frame '" + shortText(path.header.frame_id) + "' is not the map frame '" +
                                map_frame_ + "'; publish it in '" + map_frame_ + "', or set frame_id");
  }
  std::vector<StampedMotion> keyframes;
  for (const geometry_msgs::PoseStamped& each : path.poses) {
    if (each.header.stamp.isZero()) {
      throw std::invalid_argument(
          "a pose has no stamp, so that no scan belongs to it; publish poses with stamps");
    }
    if (!isPose(each.pose)) {
      throw std::invalid_argument(
          "the pose of time " + std::to_string(each.header.stamp.toSec()) +
          " is not finite, or its quaternion is not of norm 1; correct its publisher");
    }
    keyframes.push_back({each.header.stamp.toNSec(), toIsometry(each.pose)});
  }
  return keyframes;
}

std::vector<Eigen::Isometry3d> CorrectedPoses::sensorToCorrected() const {
  if (sensor_frames_.size() > 1 && corrected_frame_.empty()) {
    throw std::invalid_argument(
        "there are " + std::to_string(sensor_frames_.size()) +
        " sensors, and the path has poses of one frame; set corrected_frame_id to that frame");
  }
  std::vector<Eigen::Isometry3d> transforms;
  for (const std::string& sensor_frame : sensor_frames_) {
    if (corrected_frame_.empty() || corrected_frame_ == sensor_frame) {
      transforms.push_back(Eigen::Isometry3d::Identity());
      continue;
    }
    const auto pose = poses_.find(sensor_frame, corrected_frame_, ros::Time());
    if (!pose) {
      throw std::invalid_argument(
          "tf has no pose of corrected_frame_id '" + corrected_frame_ + "' in '" + sensor_frame +
          "'; publish it, or set corrected_frame_id to the frame whose poses " + "the path has");
    }
    transforms.push_back(pose->T_target_source);
  }
  return transforms;
}

void CorrectedPoses::use(const nav_msgs::Path& path) {
  try {
    const std::vector<StampedMotion> keyframes = keyframesOf(path);
    if (keyframes.empty()) return;  // a SLAM system that has just begun
    if (!corrector_.correct(keyframes, sensorToCorrected())) {
      throw std::invalid_argument(
          "no pose lies among the scans that are kept; compare its stamps with those of the clouds");
    }
    last_refusal_.clear();
    const MapCorrector::Progress progress = corrector_.progress();
    const std::string text = counted(progress.to_go, "scan") + " to be moved";
    if (progress.to_go > 0 && throttle_.allow(text, SentenceThrottle::Clock::now())) {
      ROS_INFO("%s: %s, by up to %.2f m", subscriber_.getTopic().c_str(), text.c_str(),
               progress.largest_move);
    }
  } catch (const std::invalid_argument& fault) {
    ++refused_;
    last_refusal_ = fault.what();
    if (throttle_.allow(last_refusal_, SentenceThrottle::Clock::now())) {
      ROS_WARN("Refused a message of %s: %s", subscriber_.getTopic().c_str(), last_refusal_.c_str());
    }
  }
  on_path_();
}

bool CorrectedPoses::update(SentenceThrottle::Clock::time_point now) {
  if (waiting_ && std::chrono::duration<double>(now - used_).count() >= kPathPeriod) {
    used_ = now;
    use(*std::exchange(waiting_, nullptr));
  }
  const MapCorrector::Progress progress = corrector_.progress();
  const bool finished = progress.done && !was_done_, done_around = progress.done_around && !was_done_around_;
  was_done_ = progress.done;
  was_done_around_ = progress.done_around;
  if (finished && throttle_.allow("finished", now)) {
    if (progress.failed == 0) {
      ROS_INFO("All scans are where %s puts them", subscriber_.getTopic().c_str());
    } else {
      ROS_WARN("%s could not be moved to where %s puts them: %s", counted(progress.failed, "scan").c_str(),
               subscriber_.getTopic().c_str(), progress.fault.c_str());
    }
  }
  return finished || done_around;
}

void CorrectedPoses::fill(MappingStatus& status) const {
  const MapCorrector::Progress progress = corrector_.progress();
  status.journal_scans = progress.scans;
  status.journal_bytes = progress.bytes;
  status.journal_forgotten = progress.forgotten;
  status.corrections = progress.paths;
  status.corrections_refused = refused_;
  status.last_correction_refusal = last_refusal_;
  status.correction_to_go = progress.to_go;
  status.correction_moved = progress.moved;
  status.correction_failed = progress.failed;
  status.correction_fault = progress.fault;
  status.correction_largest_move = static_cast<float>(progress.largest_move);
  status.correction_scan_ms = static_cast<float>(progress.scan_ms);
  status.correction_done_around = progress.done_around;
  status.correction_done = progress.done;
}

std::string CorrectedPoses::summary() const {
  const MapCorrector::Progress progress = corrector_.progress();
  if (progress.paths == 0) return "";
  std::string text = counted(progress.paths, "message") + " of " + subscriber_.getTopic() + " made " +
                     counted(progress.moved, "move") + " of scans";
  if (progress.to_go > 0) text += "; " + counted(progress.to_go, "scan") + " were still to be moved";
  if (progress.failed > 0)
    text += "; " + counted(progress.failed, "scan") + " could not be moved: " + progress.fault;
  return text;
}

}  // namespace bki_mapping::ros_interface
