/// @file PublisherSet, the publishers of all map topics: decides when each of them publishes.
#pragma once

#include <chrono>
#include <memory>
#include <vector>

#include "ros/map_publisher.h"

namespace bki_mapping::ros_interface {

/// The time from the start of one publication of a topic to the next: 1 / rate, but at least ten times what
/// the last one took, so that no topic takes more than a tenth of the time.
/// @param rate publish_rate [Hz]. @param took duration of the last publication.
std::chrono::duration<double> publishPeriod(double rate, std::chrono::duration<double> took);

/// Owns the publishers. Each publishes changes at most publish_rate times a second, and takes at most a tenth
/// of the time, however large the map.
class PublisherSet {
 public:
  explicit PublisherSet(const PublisherContext& context)
      : publishers_(makePublishers(context)), next_(publishers_.size()) {}

  /// Records blocks that were changed, created or erased.
  void changed(const std::vector<GridIndex>& blocks);
  /// Lets every publisher send the whole map again.
  void startOver();
  /// Publishes the topics that are due.
  void publishDue(const MapSnapshot& snapshot);

 private:
  using Clock = std::chrono::steady_clock;

  std::vector<std::unique_ptr<MapPublisher>> publishers_;
  std::vector<Clock::time_point> next_;  ///< earliest next publication of each publisher
};

}  // namespace bki_mapping::ros_interface
