#include "ros/pose_source.h"

#include <algorithm>
#include <cmath>

#include "bki_mapping/core/named_parameter.h"
#include "core/frame_name.h"
#include "ros/clock_offset.h"
#include "ros/pose_conversion.h"
#include "ros/time_watch.h"

namespace bki_mapping::ros_interface {

namespace {

/// tf2's tolerance on the square of a quaternion's norm.
constexpr double kNormTolerance = 1e-2;

/// A cloud whose stamp is more than this ahead of tf does not wait for a slow localisation: a clock is wrong,
/// or no more transforms come [s].
constexpr double kSlowest = 2.0;
/// tf2 keeps transforms for so long [s].
constexpr double kKeptByTf = 10.0;

/// Whether tf2 takes the name of a frame. It prints a line whenever it is asked for any other.
bool isFrame(const std::string& name) {
  return !name.empty() && name.front() != '/';
}

/// Why a transform is not a valid pose between two frames; "" if it is one.
std::string faultOf(const geometry_msgs::TransformStamped& stamped) {
  if (stamped.header.frame_id.empty()) return "it names no parent frame";
  if (stamped.child_frame_id.empty()) return "it names no child frame";
  if (stamped.child_frame_id == stamped.header.frame_id) return "the frame is its own parent";
  const geometry_msgs::Transform& transform = stamped.transform;
  const Eigen::Vector3d t(transform.translation.x, transform.translation.y, transform.translation.z);
  const Eigen::Vector4d q(transform.rotation.x, transform.rotation.y, transform.rotation.z,
                          transform.rotation.w);
  if (!t.allFinite()) return "its translation is not finite";
  if (!q.allFinite()) return "its quaternion is not finite";
  if (!(std::abs(q.squaredNorm() - 1.0) < kNormTolerance)) {
    return "the norm of its quaternion is " + numberText(q.norm()) + ", not 1";
  }
  return "";
}

}  // namespace

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

void PoseSource::add(const geometry_msgs::TransformStamped& received, bool is_static) {
  geometry_msgs::TransformStamped transform = received;
  transform.header.frame_id = frameName(received.header.frame_id);
  transform.child_frame_id = frameName(received.child_frame_id);
  const std::string& child = transform.child_frame_id;
  if (const std::string fault = faultOf(transform); !fault.empty()) {
    const std::string why = "the transform from '" + shortText(transform.header.frame_id) + "' to '" +
                            shortText(child) + "' of time " + numberText(transform.header.stamp.toSec()) +
                            " is not a pose: " + fault + "; correct its publisher";
    if (const auto before = findRefused(child); before != refused_.end()) refused_.erase(before);
    refused_.push_back({child, transform.header.stamp, why});
    if (refused_.size() > kMaxRefused) refused_.pop_front();
    if (throttle_.allow(why, SentenceThrottle::Clock::now()))
      ROS_WARN("Refused a transform: %s", why.c_str());
    return;
  }
  const auto refused = findRefused(child);
  if (refused != refused_.end() && (is_static || transform.header.stamp >= refused->stamp)) {
    refused_.erase(refused);
  }
  if (!is_static) {
    latest_.push_back(transform);
    if (latest_.size() > kKept) latest_.pop_front();
    jumps_.add(transform);
  }
  put(transform, is_static);
}

void PoseSource::put(const geometry_msgs::TransformStamped& transform, bool is_static) {
  try {
    buffer_.setTransform(transform, "bki_mapping", is_static);
  } catch (
      const std::exception& fault) {  // tf2 adds 10 s to the stamp, which may exceed the range of ros::Time
    const std::string why = "the transform to '" + shortText(transform.child_frame_id) + "' of time " +
                            numberText(transform.header.stamp.toSec()) + ": " + fault.what() +
                            "; correct the clock of its publisher";
    if (throttle_.allow(why, SentenceThrottle::Clock::now()))
      ROS_WARN("Refused a transform: %s", why.c_str());
  }
}

std::deque<PoseSource::Refused>::const_iterator PoseSource::findRefused(const std::string& child) const {
  return std::find_if(refused_.begin(), refused_.end(), [&](const Refused& r) { return r.child == child; });
}

const PoseSource::Refused* PoseSource::refusedBetween(const std::string& target,
                                                      const std::string& source) const {
  for (const std::string& end : {source, target}) {
    for (const std::string& frame : lineage(end)) {
      const auto refused = findRefused(frame);
      if (refused != refused_.end()) return &*refused;
    }
  }
  return nullptr;
}

std::vector<std::string> PoseSource::lineage(const std::string& frame) const {
  std::vector<std::string> frames = {frame};
  std::string parent;
  // Limited like in tf2, because frames may form a cycle.
  while (frames.size() < tf2::BufferCore::MAX_GRAPH_DEPTH &&
         buffer_._getParent(frames.back(), ros::Time(0), parent)) {
    frames.push_back(parent);
  }
  return frames;
}

void PoseSource::watchJumps(const std::string& target, const std::string& source, const ros::Time& stamp) {
  std::vector<std::string> up = lineage(source), down = lineage(target);
  while (!up.empty() && !down.empty() && up.back() == down.back()) {  // above both, so on the way of neither
    up.pop_back();
    down.pop_back();
  }
  up.insert(up.end(), down.begin(), down.end());
  for (const std::string& child : up) {
    const auto pose = find(child, source, stamp);
    if (!pose || !jumps_.watch(child, pose->T_target_source.translation())) continue;
    for (const auto& transform : latest_) {
      if (transform.child_frame_id == child) jumps_.add(transform);
    }
  }
}

void PoseSource::restart(const ros::Time& new_time) {
  buffer_.clear();
  const auto of_old_time = std::find_if(latest_.rbegin(), latest_.rend(), [&](const auto& transform) {
    return transform.header.stamp.toSec() > new_time.toSec() + TimeWatch::kOutOfOrder;
  });
  latest_.erase(latest_.begin(), of_old_time.base());
  for (const auto& transform : latest_) put(transform, false);
  refused_.clear();
  jumps_.restart();
}

bool PoseSource::canFind(const std::string& target, const std::string& source, const ros::Time& stamp) const {
  return isFrame(target) && isFrame(source) && buffer_.canTransform(target, source, stamp);
}

std::optional<StampedPose> PoseSource::find(const std::string& target, const std::string& source,
                                            const ros::Time& stamp) const {
  if (!canFind(target, source, stamp)) return std::nullopt;
  try {
    const auto pose = buffer_.lookupTransform(target, source, stamp);
    return StampedPose{toIsometry(pose.transform), pose.header.stamp};
  } catch (const tf2::TransformException&) {  // it may have expired since canFind
    return std::nullopt;
  }
}

std::optional<ros::Time> PoseSource::latestCommon(const std::string& target, const std::string& a,
                                                  const std::string& b) const {
  ros::Time common;
  for (const std::string& source : {a, b}) {
    const auto latest = find(target, source, ros::Time());
    if (!latest) return std::nullopt;
    const bool changes = !latest->stamp.isZero();
    if (changes && (common.isZero() || latest->stamp < common)) common = latest->stamp;
  }
  return common;
}

MissingPose PoseSource::explain(const std::string& target, const std::string& source, const ros::Time& stamp,
                                const ros::Time& now) const {
  if (source.empty()) {
    return {DropReason::kUnknownFrame,
            "its header has no frame_id; configure the driver, or set sensor_frame_id"};
  }
  const std::string from = shortText(source), to = shortText(target);
  const auto newest = find(target, source, ros::Time());
  const Refused* refused = refusedBetween(target, source);
  if (refused && (!newest || stamp > newest->stamp)) return {DropReason::kBadTransform, refused->why};
  for (const std::string& frame : {source, target}) {
    if (!isFrame(frame)) {
      return {DropReason::kUnknownFrame,
              "tf has no frames that begin with a slash, such as '" + shortText(frame) +
                  "'; correct the frame_id of the driver, frame_id or sensor_frame_id"};
    }
    if (!buffer_._frameExists(frame)) {
      return {DropReason::kUnknownFrame, "tf has never heard of frame '" + shortText(frame) +
                                             "'; publish a transform from '" + to + "' to '" + from +
                                             "', or set frame_id or sensor_frame_id"};
    }
  }
  std::string why;
  if (!buffer_.canTransform(target, source, ros::Time(0), &why)) {
    return {DropReason::kNoTransform, "no transform connects '" + from + "' with '" + to +
                                          "'; publish it, or set frame_id or sensor_frame_id (" +
                                          shortText(why, 300) + ")"};
  }
  const auto latest_pose = find(target, source, ros::Time());
  const ros::Time latest = latest_pose ? latest_pose->stamp : ros::Time();
  const std::string transforms = "the transforms from '" + from + "' to '" + to + "'";
  const double ahead = stamp.toSec() - latest.toSec();
  if (stamp > latest && ahead <= kSlowest) {
    return {DropReason::kTransformLate,
            "the latest of " + transforms + " is " + numberText(std::round(1e3 * ahead)) +
                " ms older than the cloud; " + timeout_remedy_ + "make the localisation publish sooner"};
  }
  if (stamp > latest && !now.isZero() && std::abs(now.toSec() - stamp.toSec()) <= kSlowest) {
    return {
        DropReason::kTransformLate,
        transforms + " are " + durationText(ahead) +
            " older than the cloud, whose stamp is that of this computer: their publisher has stopped, or "
            "its clock is behind; start it again, or synchronise its clock"};
  }
  if (stamp > latest) {
    return {DropReason::kTransformLate, "its stamp is " + durationText(ahead) + " ahead of the latest of " +
                                            transforms + clockAdvice(stamp, latest)};
  }
  if (-ahead <= kKeptByTf) {
    return {DropReason::kTooOld, transforms + " do not reach back to the cloud: the latest is " +
                                     durationText(-ahead) +
                                     " newer; send clouds sooner, or check the clocks"};
  }
  return {DropReason::kTooOld, "its stamp is " + durationText(-ahead) + " behind the latest of " +
                                   transforms + ", of which tf keeps 10 s; send clouds sooner" +
                                   clockAdvice(stamp, latest)};
}

}  // namespace bki_mapping::ros_interface
