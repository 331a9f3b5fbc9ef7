#include "ros/scan_ledger.h"

#include "core/frame_name.h"
#include "ros/point_account.h"

namespace bki_mapping::ros_interface {
namespace {

/// 0 of nothing.
float fractionOf(double part, double all) {
  return all > 0.0 ? static_cast<float>(part / all) : 0.0f;
}

}  // namespace

const std::vector<DropKind>& dropKinds() {
  using S = MappingStatus;
  static const std::vector<DropKind> kinds = {
      {DropReason::kNoTransform, "no transform", &S::dropped_no_transform},
      {DropReason::kTransformLate, "transform late", &S::dropped_transform_late},
      {DropReason::kTooOld, "too old", &S::dropped_too_old},
      {DropReason::kUnknownFrame, "unknown frame", &S::dropped_unknown_frame},
      {DropReason::kBadTransform, "bad transform", &S::dropped_bad_transform},
      {DropReason::kBadCloud, "bad cloud", &S::dropped_bad_cloud},
      {DropReason::kEmpty, "empty", &S::dropped_empty},
      {DropReason::kQueueFull, "queue full", &S::dropped_queue_full},
      {DropReason::kTooLarge, "too large", &S::dropped_too_large},
      {DropReason::kMemory, "memory limit", &S::dropped_memory},
      {DropReason::kPaused, "paused", &S::dropped_paused},
      {DropReason::kTimeJump, "time jump", &S::dropped_time_jump},
  };
  return kinds;
}

void ScanLedger::received(Clock::time_point now) {
  ++status_.received;
  received_rate_.tick(now);
}

void ScanLedger::integrated(const std_msgs::Header& header, const ScanStats& stats, double latency,
                            Clock::time_point now) {
  ++status_.integrated;
  status_.header = header;
  status_.header.frame_id = frameName(header.frame_id);
  status_.integrated_last = true;
  status_.last_drop.clear();
  status_.last_drop_reason.clear();
  status_.points_received += stats.counts.points;
  status_.points_used += stats.counts.used;
  status_.points_no_returns += stats.counts.no_returns;
  for (const PointKind& kind : pointKinds()) status_.*kind.in_status += stats.counts.*kind.in_scan;
  const PointCounts& counts = stats.counts;
  const auto particles = static_cast<double>(counts.airborne + counts.isolated);
  const auto none = static_cast<double>(counts.no_returns + counts.no_direction);
  status_.weather_particles = fractionOf(particles, particles + static_cast<double>(counts.used));
  status_.weather_no_returns = fractionOf(none, static_cast<double>(counts.points));
  status_.weather_half_range = static_cast<float>(stats.half_range);
  status_.labels_not_in_table += stats.counts.labels_not_in_table;
  status_.integration_ms = static_cast<float>(stats.totalMs());
  integration_.add(stats.totalMs());
  latency_.add(1e3 * latency);
  integrated_rate_.tick(now);
}

void ScanLedger::dropped(const std_msgs::Header& header, DropReason reason, const std::string& why) {
  const DropKind& kind = dropKinds()[static_cast<std::size_t>(reason)];
  ++(status_.*kind.count);
  status_.header = header;
  status_.header.frame_id = frameName(header.frame_id);
  status_.integrated_last = false;
  status_.last_drop = why;
  status_.last_drop_reason = kind.name;
}

std::uint64_t ScanLedger::droppedClouds() const {
  std::uint64_t sum = 0;
  for (const DropKind& kind : dropKinds()) sum += status_.*kind.count;
  return sum;
}

MappingStatus ScanLedger::status(Clock::time_point now, std::size_t waiting) {
  status_.waiting = waiting;
  status_.received_hz = static_cast<float>(received_rate_.rate(now));
  status_.integrated_hz = static_cast<float>(integrated_rate_.rate(now));
  status_.latency_median_ms = static_cast<float>(latency_.median());
  status_.latency_p99_ms = static_cast<float>(latency_.quantile(0.99));
  status_.integration_median_ms = static_cast<float>(integration_.median());
  status_.integration_p99_ms = static_cast<float>(integration_.quantile(0.99));
  status_.labels_missing = unknown_.missing();
  status_.unknown_labels.clear();
  status_.unknown_label_counts.clear();
  for (const auto& [label, count] : unknown_.counts()) {
    status_.unknown_labels.push_back(label);
    status_.unknown_label_counts.push_back(count);
  }
  return status_;
}

std::string ScanLedger::summary(std::size_t waiting) const {
  std::string text = "Mapped " + std::to_string(status_.integrated) + " of " +
                     std::to_string(status_.received) + " clouds; dropped";
  const char* separator = ": ";
  for (const DropKind& kind : dropKinds()) {
    if (status_.*kind.count == 0) continue;
    text += separator + std::to_string(status_.*kind.count) + " " + kind.name;
    separator = ", ";
  }
  if (droppedClouds() == 0) text += " none";
  text += "; used " + std::to_string(status_.points_used) + " of " + std::to_string(status_.points_received) +
          " points";
  if (waiting > 0) text += "; " + std::to_string(waiting) + " were still waiting";
  return text;
}

}  // namespace bki_mapping::ros_interface
