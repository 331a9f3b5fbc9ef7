#include "ros/publisher_set.h"

#include <algorithm>

namespace bki_mapping::ros_interface {

std::chrono::duration<double> publishPeriod(double rate, std::chrono::duration<double> took) {
  constexpr double kMaxFraction = 0.1;  // of the time
  return std::max(std::chrono::duration<double>(1.0 / rate), took / kMaxFraction);
}

void PublisherSet::changed(const std::vector<GridIndex>& blocks) {
  for (const auto& publisher : publishers_) {
    if (publisher->wanted()) publisher->changed.add(blocks);
  }
}

void PublisherSet::startOver() {
  for (const auto& publisher : publishers_) {
    if (publisher->wanted()) publisher->startOver();
  }
}

void PublisherSet::publishDue(const MapSnapshot& snapshot) {
  for (std::size_t p = 0; p < publishers_.size(); ++p) {
    MapPublisher& publisher = *publishers_[p];
    if (!publisher.wanted()) {
      publisher.rest();
      continue;
    }
    const auto start = Clock::now();
    if (publisher.changed.empty() || start < next_[p]) continue;
    publisher.tryTo([&] { publisher.publish(snapshot); });
    next_[p] = start + std::chrono::duration_cast<Clock::duration>(
                           publishPeriod(snapshot.config.publish_rate, Clock::now() - start));
  }
}

}  // namespace bki_mapping::ros_interface
