/// @file Accounts for every cloud: received = integrated + dropped + waiting.
#pragma once

#include <bki_mapping/MappingStatus.h>

#include <array>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "core/unlisted_labels.h"
#include "ros/rolling_statistics.h"

namespace bki_mapping::ros_interface {

/// Why a cloud is not in the map.
enum class DropReason {
  kNoTransform,
  kTransformLate,
  kTooOld,
  kUnknownFrame,
  kBadTransform,
  kBadCloud,
  kEmpty,
  kQueueFull,
  kTooLarge,
  kMemory,
  kPaused,
  kTimeJump,
};

/// A reason's name, and its counter in the status.
struct DropKind {
  DropReason reason;
  const char* name;
  std::uint64_t MappingStatus::*count;
};
/// All reasons, in the order of the enumeration.
const std::vector<DropKind>& dropKinds();

/// Counts clouds and measures their times. Not thread-safe.
class ScanLedger {
 public:
  using Clock = RateMeter::Clock;

  void received(Clock::time_point now);
  /// @param latency from the reception of the cloud to the end of its integration [s].
  void integrated(const std_msgs::Header& header, const ScanStats& stats, double latency,
                  Clock::time_point now);
  /// @param why a sentence with the remedy.
  void dropped(const std_msgs::Header& header, DropReason reason, const std::string& why);
  /// Adds counts of labels that are not in the class table.
  void unlistedLabels(const UnlistedLabels& labels) { unknown_ += labels; }
  void timeJumped() { ++status_.time_jumps; }
  void tfJumped() { ++status_.tf_jumps; }

  std::uint64_t droppedClouds() const;
  const RollingStatistics& integration() const { return integration_; }  ///< [ms]

  /// The status, with the rates as of `now`. @param waiting number of clouds in the queue.
  MappingStatus status(Clock::time_point now, std::size_t waiting);
  /// The counts in one line, for the log.
  std::string summary(std::size_t waiting) const;

 private:
  MappingStatus status_;
  RollingStatistics latency_, integration_;
  RateMeter received_rate_, integrated_rate_;
  UnlistedLabels unknown_;
};

}  // namespace bki_mapping::ros_interface
