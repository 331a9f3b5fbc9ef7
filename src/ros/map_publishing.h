/// @file When which map topic is published.
#pragma once

#include <chrono>
#include <memory>
#include <vector>

#include "ros/map_publisher.h"

namespace bki_mapping::ros_shell {

/// The time from one publication of a topic to the next [s]: that of the rate, or ten times what the first
/// took, so that no topic takes more than a tenth of the time. @param rate publish_rate [Hz].
std::chrono::duration<double> publishPeriod(double rate, std::chrono::duration<double> took);

/// Owns the publishers. Each publishes what changed at most publish_rate times a second, and takes at most a
/// tenth of the time, however large the map.
class MapPublishing {
 public:
  explicit MapPublishing(const PublisherContext& context)
      : publishers_(makePublishers(context)), next_(publishers_.size()) {}

  /// Blocks that changed, or were made or erased.
  void changed(const std::vector<GridIndex>& blocks);
  /// Everything changed, or is to be sent again.
  void startOver();
  /// Publishes what is due.
  void publishDue(const MapSnapshot& snapshot);

 private:
  using Clock = std::chrono::steady_clock;

  std::vector<std::unique_ptr<MapPublisher>> publishers_;
  std::vector<Clock::time_point> next_;  ///< of each publisher: not before this
};

}  // namespace bki_mapping::ros_shell
