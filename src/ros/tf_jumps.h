/// @file Notices when tf jumps, as when a localisation closes a loop.
#pragma once

#include <geometry_msgs/TransformStamped.h>

#include <Eigen/Geometry>
#include <deque>
#include <map>
#include <string>
#include <vector>

namespace bki_mapping::ros_interface {

/// A jump of one transform.
struct TfJump {
  std::string parent, child;
  ros::Time stamp;  ///< of the first transform after the jump
  double distance;  ///< of the sensor [m]
  double angle;     ///< [degrees]
};

/// What has jumped, how far, and what that means for the map; without the remedy.
std::string sentenceOf(const TfJump& jump);

/// Watches transforms on the way from the sensor to the map. A step between two consecutive transforms is a
/// jump if the sensor moves in it by kLeastDistance or kLeastAngle more than the velocities before and after
/// it explain. A motion that goes on is therefore none, however suddenly it begins, nor is a slow correction.
class TfJumpWatch {
 public:
  static constexpr double kLeastDistance = 0.2;  ///< [m]
  static constexpr double kLeastAngle = 2.0;     ///< [degrees]

  /// Watches the transforms of a child frame from now on, unless kMostFrames are watched. Of several sensors
  /// the farthest from the frame counts. @param sensor its position in the child frame [m].
  /// @return whether they are watched and were not before.
  bool watch(const std::string& child, const Eigen::Vector3d& sensor);
  /// Takes a transform that tf takes, too.
  void add(const geometry_msgs::TransformStamped& transform);
  /// Forgets all transforms, because time has jumped.
  void restart() { edges_.clear(); }
  /// The jumps since the last call.
  std::vector<TfJump> take();

 private:
  /// Steps before one that say how the frame moves.
  static constexpr std::size_t kSteps = 5;
  /// Frames that are watched at once; a faulty sender must not fill the memory.
  static constexpr std::size_t kMostFrames = 64;

  struct Sample {
    ros::Time stamp;
    Eigen::Isometry3d T_parent_child;
  };
  struct Edge {
    Eigen::Vector3d sensor;
    std::string parent;
    std::deque<Sample> samples;  ///< the latest kSteps + 3, in order of time
  };

  /// Whether the step to the last sample but one is a jump.
  void judge(const std::string& child, const Edge& edge);

  std::map<std::string, Edge> edges_;
  std::vector<TfJump> jumps_;
};

}  // namespace bki_mapping::ros_interface
