/// @file Looks up sensor poses in tf2, and explains why a pose is missing.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/node_handle.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/buffer.h>

#include <Eigen/Geometry>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "ros/scan_ledger.h"
#include "ros/sentence_throttle.h"
#include "ros/tf_jumps.h"

namespace bki_mapping::ros_interface {

/// A pose at a time.
struct StampedPose {
  Eigen::Isometry3d T_target_source;
  ros::Time stamp;
};

/// Why a pose is missing: the reason to be counted, and a sentence with the remedy.
struct MissingPose {
  DropReason reason;
  std::string why;
};

/// Looks poses up in tf. Frames are asked for by their frameName(); transforms may name them with a slash.
/// Unlike tf2_ros::TransformListener, it can restart when time jumps back and keep the transforms of the new
/// time that arrived before the jump was noticed.
class PoseSource {
 public:
  /// Does not subscribe; transforms come from add().
  PoseSource() = default;
  /// Subscribes to /tf and /tf_static on the node handle's callback queue.
  explicit PoseSource(ros::NodeHandle node);

  /// Says that clouds do not wait for tf_timeout, so that explain() does not advise to raise it.
  void ignoreTimeout() { timeout_remedy_.clear(); }

  /// Adds a transform. Refuses one between no two frames, that is not finite, or whose quaternion is not of
  /// norm 1; explain() names it.
  void add(const geometry_msgs::TransformStamped& transform, bool is_static = false);

  /// The pose of `source` in `target`, interpolated at `stamp`; the latest one if the stamp is 0.
  /// @return nullopt if tf has no such pose (yet).
  std::optional<StampedPose> find(const std::string& target, const std::string& source,
                                  const ros::Time& stamp) const;

  /// Whether find would return a pose.
  bool canFind(const std::string& target, const std::string& source, const ros::Time& stamp) const;

  /// The latest time at which `a` and `b` both have a pose in `target`; 0 if both poses are static.
  /// @return nullopt if one of them has no pose.
  std::optional<ros::Time> latestCommon(const std::string& target, const std::string& a,
                                        const std::string& b) const;

  /// Explains why find() returns nullopt. @param now the time on this computer; 0: not known.
  MissingPose explain(const std::string& target, const std::string& source, const ros::Time& stamp,
                      const ros::Time& now = {}) const;

  /// Watches the transforms between the frames for jumps. @param stamp at which find() has found the pose.
  void watchJumps(const std::string& target, const std::string& source, const ros::Time& stamp);
  /// The jumps since the last call.
  std::vector<TfJump> takeJumps() { return jumps_.take(); }

  /// Forgets the transforms of the old time after a jump back. Keeps static ones and, from the most recently
  /// received one backwards, those up to the first whose stamp is more than TimeWatch::kOutOfOrder ahead of
  /// `new_time`.
  void restart(const ros::Time& new_time);

 private:
  static constexpr std::size_t kKept = 1000;
  static constexpr std::size_t kMaxRefused = 100;

  /// A transform that is not a valid pose.
  struct Refused {
    std::string child;
    ros::Time stamp;
    std::string why;
  };

  /// Hands a transform to tf2.
  void put(const geometry_msgs::TransformStamped& transform, bool is_static);
  void onTransforms(const tf2_msgs::TFMessage& message, bool is_static);
  std::deque<Refused>::const_iterator findRefused(const std::string& child) const;
  /// A refused transform between the frames, for lack of which find() fails; nullptr if there is none.
  const Refused* refusedBetween(const std::string& target, const std::string& source) const;
  /// The frame and those above it, up to the root of tf's tree.
  std::vector<std::string> lineage(const std::string& frame) const;

  tf2_ros::Buffer buffer_;
  std::string timeout_remedy_ = "raise tf_timeout, or ";
  std::deque<geometry_msgs::TransformStamped> latest_;  ///< of /tf, in order of reception
  std::deque<Refused> refused_;  ///< the last one per child frame, until a newer one is valid
  TfJumpWatch jumps_;
  SentenceThrottle throttle_;
  ros::Subscriber subscriber_, static_subscriber_;
};

}  // namespace bki_mapping::ros_interface
