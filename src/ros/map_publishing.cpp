#include "bki_mapping/ros/map_publishing.h"

#include <algorithm>

namespace bki_mapping::ros_shell {
namespace {

/// The pause after publishing a topic, in times of what publishing took.
constexpr int kPause = 9;

}  // namespace

void MapPublishing::changed(const std::vector<GridIndex>& blocks) {
  for (const auto& publisher : publishers_) {
    if (publisher->wanted()) publisher->changed.add(blocks);
  }
}

void MapPublishing::startOver() {
  for (const auto& publisher : publishers_) {
    if (publisher->wanted()) publisher->startOver();
  }
}

void MapPublishing::publishDue(const MapSnapshot& snapshot) {
  const std::chrono::duration<double> period(1.0 / snapshot.config.publish_rate);
  for (std::size_t p = 0; p < publishers_.size(); ++p) {
    MapPublisher& publisher = *publishers_[p];
    if (!publisher.wanted()) {
      publisher.rest();
      continue;
    }
    const auto start = Clock::now();
    if (publisher.changed.empty() || start < next_[p]) continue;
    publisher.publish(snapshot);
    const auto took = Clock::now() - start;
    next_[p] = start + std::max<Clock::duration>(std::chrono::duration_cast<Clock::duration>(period),
                                                 (kPause + 1) * took);
  }
}

}  // namespace bki_mapping::ros_shell
