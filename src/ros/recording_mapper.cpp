#include "ros/recording_mapper.h"

#include <chrono>
#include <cstdio>
#include <limits>
#include <utility>

#include "bki_mapping/core/named_parameter.h"
#include "ros/cloud_frame.h"

namespace bki_mapping::ros_interface {
namespace {

/// The time of a recording as that of a WaitingCloud.
ScanLedger::Clock::time_point timePoint(const ros::Time& recorded) {
  return ScanLedger::Clock::time_point(std::chrono::nanoseconds(recorded.toNSec()));
}

std::string secondsText(const ros::Time& stamp) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", stamp.toSec());
  return text;
}

}  // namespace

RecordingMapper::RecordingMapper(SemanticMapper& mapper, const ServerConfig& config,
                                 const std::vector<InputConfig>& inputs, Listener listener, KeptScans* kept)
    : mapper_(mapper),
      kept_(kept),
      frame_(config.frame_id),
      on_time_jump_(config.on_time_jump),
      listener_(std::move(listener)),
      odometry_(config.correction.odometry_frame_id, poses_),
      points_(inputs.size()) {
  poses_.ignoreTimeout();
  for (const InputConfig& input : inputs) {
    readers_.emplace_back(input, frame_, mapper_.classes(), mapper_.config().label_values,
                          kept_ ? ScanAxes::kSensor : ScanAxes::kMap);
    notes_.emplace_back(input.topic);
  }
}

void RecordingMapper::addTransforms(const tf2_msgs::TFMessage& message, bool is_static) {
  for (const auto& transform : message.transforms) poses_.add(transform, is_static);
}

void RecordingMapper::addCloud(std::size_t input, const sensor_msgs::PointCloud2ConstPtr& cloud,
                               const ros::Time& recorded) {
  passCloud(input, cloud->header.stamp);
  ledger_.received(ScanLedger::Clock::now());
  waiting_.push({cloud, input, timePoint(recorded)}, std::numeric_limits<std::size_t>::max(),
                QueuePolicy::kDropOldest);
}

void RecordingMapper::passCloud(std::size_t input, const ros::Time& stamp) {
  if (time_watch_.stampsWentBack(input, stamp)) onTimeJump(stamp);
}

void RecordingMapper::refuseCloud(std::size_t input, const std::string& why) {
  ledger_.received(ScanLedger::Clock::now());
  drop(input, {}, DropReason::kBadCloud, why);
}

void RecordingMapper::advance(const ros::Time& recorded) {
  const auto is_due = [&](WaitingCloud& waiting) {
    const std::chrono::duration<double> waited = timePoint(recorded) - waiting.received;
    return waited.count() >= kLongestWait ||
           readers_[waiting.input].ready(*waiting.cloud, poses_, waiting.times);
  };
  while (const auto next = waiting_.takeIf(is_due)) map(*next);
}

void RecordingMapper::finish() {
  while (const auto next = waiting_.takeIf([](const WaitingCloud&) { return true; })) map(*next);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const InputConfig& input = readers_[i].input();
    const Health health =
        judgePoints(points_[i], input.topic, input, mapper_.config(), mapper_.classes().name());
    if (!health.message.empty()) warnOnce(health.message);
  }
}

void RecordingMapper::map(const WaitingCloud& waiting) {
  const Remedies remedies{" (waited " + numberText(kLongestWait) + " s of the recording, or until its end)",
                          "; or map fewer clouds at a time, and merge the maps"};
  const auto refused = mapCloud(*waiting.cloud, readers_[waiting.input], poses_, {}, mapper_.map().geometry(),
                                remedies, [&](const PlacedScan& placed) { integrate(waiting, placed); });
  if (refused) drop(waiting.input, waiting.cloud->header, refused->reason, refused->why);
}

ScanStats RecordingMapper::addToMap(const PlacedScan& placed, const std::string& sensor_frame) {
  if (!kept_) return mapper_.integrate(placed.scan);
  kept_->update();
  const OdometryPoses::Pose odometry = odometry_.of(sensor_frame, placed.scan.stamp, placed.T_map_sensor);
  if (odometry.is_first) kept_->noteJump(placed.scan.stamp);
  if (!odometry.warning.empty()) warnOnce(odometry.warning);
  return kept_->integrateRecorded(placed.scan, placed.T_map_sensor, sensor_frame, odometry.T_odometry_sensor);
}

void RecordingMapper::integrate(const WaitingCloud& waiting, const PlacedScan& placed) {
  const std::string sensor_frame = readers_[waiting.input].sensorFrame(*waiting.cloud);
  const ScanStats stats = addToMap(placed, sensor_frame);
  ledger_.integrated(waiting.cloud->header, stats, 0.0, ScanLedger::Clock::now());
  ledger_.unlistedLabels(placed.unlisted_labels);
  points_[waiting.input].add(stats.counts, placed.unlisted_labels);
  InputNotes& notes = notes_[waiting.input];
  const InputSentences sentences = notes.ofScan(*waiting.cloud, placed, stats.counts, readers_[waiting.input],
                                                mapper_.classes(), mapper_.config());
  for (const std::string& sentence : sentences.warnings) listener_.warn(sentence);
  for (const std::string& sentence : sentences.notes) listener_.inform(sentence);
  points_[waiting.input].label_remedy = notes.labelRemedy();
  poses_.watchJumps(frame_, sensor_frame, ros::Time().fromNSec(placed.scan.stamp));
  for (const TfJump& jump : poses_.takeJumps()) {
    ledger_.tfJumped();
    if (kept_ && odometry_.isMapFrame()) kept_->noteJump(jump.stamp.toNSec());
    warnOnce(sentenceOf(jump) + (kept_ ? "; correct the map file with correct_map"
                                       : "; map a recording with the corrected poses"));
  }
  const std::string far = farFromOriginWarning(placed.scan.origin, mapper_.config().resolution, frame_);
  if (!far.empty()) warnOnce(far);
  drive_.addScan(placed.scan.stamp, mapper_.map().geometry(), mapper_.touchedBlocks());
  listener_.mapped(placed, stats);
}

void RecordingMapper::drop(std::size_t input, const std_msgs::Header& header, DropReason reason,
                           const std::string& why) {
  ledger_.dropped(header, reason, why);
  drops_.emplace(reason, why);
  const std::string& topic = readers_[input].input().topic;
  if (!throttle_.allow(topic + why, {})) return;
  listener_.warn("dropped the cloud of " + topic + " of time " + secondsText(header.stamp) + ": " + why);
}

void RecordingMapper::onTimeJump(const ros::Time& new_time) {
  ledger_.timeJumped();
  time_watch_.restart();
  poses_.restart(new_time);
  const auto of_old_time = [&](const WaitingCloud& waiting) {
    return waiting.cloud->header.stamp.toSec() > new_time.toSec() + TimeWatch::kOutOfOrder;
  };
  while (const auto waiting = waiting_.takeIf(of_old_time)) {
    drop(waiting->input, waiting->cloud->header, DropReason::kTimeJump, "time jumped back while it waited");
  }
  const bool forget = on_time_jump_ == OnTimeJump::kReset;
  if (forget) {
    mapper_.reset();
    if (kept_) kept_->reset();
    drive_ = {};
    listener_.forgotten();
  }
  listener_.warn("the stamps of clouds went back to time " + secondsText(new_time) +
                 ": old transforms are dropped, the map is " + (forget ? "reset" : "kept") +
                 " (on_time_jump)");
}

/// At one constant time, a throttle lets a sentence through only once.
void RecordingMapper::warnOnce(const std::string& sentence) {
  if (throttle_.allow(sentence, {})) listener_.warn(sentence);
}

}  // namespace bki_mapping::ros_interface
