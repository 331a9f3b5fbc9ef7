#include "bki_mapping/ros/pose_source.h"

#include <algorithm>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/ros/pose_conversion.h"
#include "bki_mapping/ros/time_watch.h"

namespace bki_mapping::ros_shell {

PoseSource::PoseSource(ros::NodeHandle node) {
  using Message = tf2_msgs::TFMessageConstPtr;
  subscriber_ = node.subscribe<tf2_msgs::TFMessage>(
      "/tf", 1000, [this](const Message& message) { onTransforms(*message, false); });
  static_subscriber_ = node.subscribe<tf2_msgs::TFMessage>(
      "/tf_static", 1000, [this](const Message& message) { onTransforms(*message, true); });
}

void PoseSource::onTransforms(const tf2_msgs::TFMessage& message, bool is_static) {
  for (const auto& transform : message.transforms) add(transform, is_static);
}

void PoseSource::add(const geometry_msgs::TransformStamped& transform, bool is_static) {
  if (!is_static) {
    latest_.push_back(transform);
    if (latest_.size() > kKept) latest_.pop_front();
  }
  try {
    buffer_.setTransform(transform, "bki_mapping", is_static);
  } catch (const tf2::TransformException& fault) {
    ROS_WARN_THROTTLE(5.0, "Ignored a transform of '%s': %s", transform.child_frame_id.c_str(), fault.what());
  }
}

void PoseSource::restart(const ros::Time& new_time) {
  buffer_.clear();
  const auto of_old_time = std::find_if(latest_.rbegin(), latest_.rend(), [&](const auto& transform) {
    return transform.header.stamp.toSec() > new_time.toSec() + TimeWatch::kOutOfOrder;
  });
  latest_.erase(latest_.begin(), of_old_time.base());
  for (const auto& transform : latest_) buffer_.setTransform(transform, "bki_mapping");
}

std::optional<StampedPose> PoseSource::find(const std::string& target, const std::string& source,
                                            const ros::Time& stamp) const {
  if (!canFind(target, source, stamp)) return std::nullopt;
  try {
    const auto pose = buffer_.lookupTransform(target, source, stamp);
    return StampedPose{toIsometry(pose.transform), pose.header.stamp};
  } catch (const tf2::TransformException&) {  // it may have gone since canTransform
    return std::nullopt;
  }
}

MissingPose PoseSource::explain(const std::string& target, const std::string& source,
                                const ros::Time& stamp) const {
  if (source.empty()) {
    return {DropReason::kUnknownFrame,
            "its header has no frame_id; let the driver set one, or set sensor_frame_id"};
  }
  for (const std::string& frame : {source, target}) {
    if (!buffer_._frameExists(frame)) {
      return {DropReason::kUnknownFrame, "tf has never heard of frame '" + frame +
                                             "'; publish a transform from '" + target + "' to '" + source +
                                             "', or set frame_id or sensor_frame_id"};
    }
  }
  std::string why;
  if (!buffer_.canTransform(target, source, ros::Time(0), &why)) {
    return {DropReason::kNoTransform, "no transform connects '" + source + "' with '" + target +
                                          "'; publish it, or set frame_id or sensor_frame_id (" + why + ")"};
  }
  const ros::Time latest = buffer_.lookupTransform(target, source, ros::Time(0)).header.stamp;
  if (stamp > latest) {
    return {DropReason::kTransformLate,
            "the latest transform from '" + source + "' to '" + target + "' is " +
                numberText(std::round(1e3 * (stamp.toSec() - latest.toSec()))) +
                " ms older than the cloud; raise tf_timeout, or let the localisation publish sooner"};
  }
  return {DropReason::kTooOld, "the transforms held from '" + source + "' to '" + target +
                                   "' do not reach back to it: the latest is " +
                                   numberText(std::round(1e3 * (latest.toSec() - stamp.toSec())) / 1e3) +
                                   " s newer; let clouds come sooner, or check the clocks"};
}

}  // namespace bki_mapping::ros_shell
