/// @file Takes corrected poses of the past, as a SLAM system publishes them, and moves the scans of the map.
#pragma once

#include <bki_mapping/MappingStatus.h>
#include <nav_msgs/Path.h>
#include <ros/node_handle.h>

#include <functional>
#include <string>
#include <vector>

#include "journal/map_corrector.h"
#include "ros/odometry_poses.h"
#include "ros/scan_reader.h"
#include "ros/sentence_throttle.h"
#include "ros/server_config.h"

namespace bki_mapping::ros_interface {

/// Subscribes to corrected_path, and notes each scan for the corrector. For the mapping thread.
class CorrectedPoses {
 public:
  /// Time between two messages that are used, at least: of those in between the last counts [s].
  static constexpr double kPathPeriod = 1.0;

  /// @param poses, corrector must outlive this. @param on_path is called after each message that is used or
  /// refused.
  CorrectedPoses(ros::NodeHandle& node, const ServerConfig& config, const PoseSource& poses,
                 MapCorrector& corrector, std::function<void()> on_path);

  /// The scan as it is to be mapped, rounded for the journal. @param placed in the axes of the sensor.
  RoundedScan round(const PlacedScan& placed) const {
    return corrector_.roundRecorded(placed.scan, placed.T_map_sensor);
  }
  /// Notes a rounded scan that has been integrated. @param touched blocks.
  void add(SensorScan scan, const Eigen::Isometry3d& T_map_sensor, const std::string& sensor_frame,
           const std::vector<GridIndex>& touched);

  /// The frames of the sensors, by their numbers in the corrector.
  const std::vector<std::string>& sensorFrames() const { return sensor_frames_; }
  /// The scans were forgotten, and with them their sensors.
  void reset() { sensor_frames_.clear(); }
  /// Notes that tf has jumped between the map and a sensor. @param stamp of the first transform after it.
  void noteJump(const ros::Time& stamp);
  /// Uses the last message, if it is time. @return whether there is news for the status: the map is right,
  /// which it also logs, or is so around the robot.
  bool update(SentenceThrottle::Clock::time_point now);
  void fill(MappingStatus& status) const;
  /// What became of corrections, for the log; "" if there were none.
  std::string summary() const;

 private:
  void onPath(const nav_msgs::PathConstPtr& path) { waiting_ = path; }
  void use(const nav_msgs::Path& path);
  /// The poses of a message. @throws std::invalid_argument in one sentence if they are of no use.
  std::vector<StampedMotion> keyframesOf(const nav_msgs::Path& path) const;
  /// The pose of corrected_frame_id in the frame of each sensor. @throws std::invalid_argument if tf lacks
  /// one.
  std::vector<Eigen::Isometry3d> sensorToCorrected() const;
  /// Number of a sensor by its frame.
  std::size_t numberOf(const std::string& sensor_frame);

  std::string map_frame_, corrected_frame_;
  const PoseSource& poses_;
  OdometryPoses odometry_;
  MapCorrector& corrector_;
  std::function<void()> on_path_;
  std::vector<std::string> sensor_frames_;
  std::string last_refusal_;
  std::uint64_t refused_ = 0;
  bool was_done_ = true, was_done_around_ = true, said_forgotten_ = false;
  nav_msgs::PathConstPtr waiting_;            ///< the last message, until it is used
  SentenceThrottle::Clock::time_point used_;  ///< when the last one was
  SentenceThrottle throttle_;
  ros::Subscriber subscriber_;
};

}  // namespace bki_mapping::ros_interface
