/// @file Sensor poses from tf2, and why there is none.
#pragma once

#include <geometry_msgs/TransformStamped.h>
#include <ros/node_handle.h>
#include <tf2_msgs/TFMessage.h>
#include <tf2_ros/buffer.h>

#include <Eigen/Geometry>
#include <deque>
#include <optional>
#include <string>

#include "ros/scan_ledger.h"
#include "ros/sentence_throttle.h"

namespace bki_mapping::ros_shell {

/// A pose at a time.
struct StampedPose {
  Eigen::Isometry3d T_target_source;
  ros::Time stamp;
};

/// Why a pose is missing: the reason to count, and a sentence with the remedy.
struct MissingPose {
  DropReason reason;
  std::string why;
};

/// Looks poses up in tf. Unlike tf2_ros::TransformListener it can begin anew when time jumps back without
/// losing the transforms that came before anybody knew.
class PoseSource {
 public:
  /// Without subscriptions; transforms come from add().
  PoseSource() = default;
  /// Listens to /tf and /tf_static on the node handle's callback queue.
  explicit PoseSource(ros::NodeHandle node);

  /// Takes a transform over. One that is not finite or no rotation is refused, and explain() remembers it.
  void add(const geometry_msgs::TransformStamped& transform, bool is_static = false);

  /// The pose of `source` in `target`, interpolated at a time; the latest one if the stamp is 0.
  /// @return none while tf cannot tell (yet).
  std::optional<StampedPose> find(const std::string& target, const std::string& source,
                                  const ros::Time& stamp) const;

  /// Whether find would return a pose.
  bool canFind(const std::string& target, const std::string& source, const ros::Time& stamp) const {
    return !source.empty() && buffer_.canTransform(target, source, stamp);
  }

  /// The latest time at which `a` and `b` both have a pose in `target`; 0 if these never change. None while
  /// one of them has no pose.
  std::optional<ros::Time> latestCommon(const std::string& target, const std::string& a,
                                        const std::string& b) const;

  /// Explains why find returns none.
  MissingPose explain(const std::string& target, const std::string& source, const ros::Time& stamp) const;

  /// Forgets all transforms but static ones and those of the new time: the latest to come, up to the first
  /// that is more than TimeWatch::kOutOfOrder ahead of it.
  void restart(const ros::Time& new_time);

 private:
  static constexpr std::size_t kKept = 1000;
  static constexpr std::size_t kMostRefused = 100;

  /// A transform that is no pose.
  struct Refused {
    std::string child;
    ros::Time stamp;
    std::string why;
  };

  /// Gives a transform to tf2.
  void put(const geometry_msgs::TransformStamped& transform, bool is_static);
  void onTransforms(const tf2_msgs::TFMessage& message, bool is_static);
  std::deque<Refused>::const_iterator findRefused(const std::string& child) const;
  /// The refused transform that find lacks, if there is one between the frames.
  const Refused* refusedBetween(const std::string& target, const std::string& source) const;

  tf2_ros::Buffer buffer_;
  std::deque<geometry_msgs::TransformStamped> latest_;  ///< of /tf, in the order in which they came
  std::deque<Refused> refused_;  ///< the last one of each child frame, until a newer one is good
  SentenceThrottle throttle_;
  ros::Subscriber subscriber_, static_subscriber_;
};

}  // namespace bki_mapping::ros_shell
