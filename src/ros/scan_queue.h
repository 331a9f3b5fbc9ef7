/// @file Clouds that wait to be mapped.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <chrono>
#include <deque>
#include <optional>

namespace bki_mapping::ros_shell {

/// Which cloud a full queue gives up.
enum class QueuePolicy { kDropOldest, kDropNewest };

struct WaitingCloud {
  sensor_msgs::PointCloud2ConstPtr cloud;
  std::size_t input = 0;                           ///< which of the server's inputs it came from
  std::chrono::steady_clock::time_point received;  ///< when it came
};

/// A bounded queue from which clouds are taken in their order, past those that must still wait.
class ScanQueue {
 public:
  std::size_t size() const { return clouds_.size(); }

  /// Adds a cloud. @return the one given up for it, or the cloud itself, if more than `most` would wait.
  std::optional<WaitingCloud> push(WaitingCloud cloud, std::size_t most, QueuePolicy policy) {
    if (clouds_.size() >= most && policy == QueuePolicy::kDropNewest) return cloud;
    clouds_.push_back(std::move(cloud));
    return clouds_.size() > most ? pop(clouds_.begin()) : std::nullopt;
  }

  /// Takes out the first cloud for which ready(cloud) is true.
  template <typename Ready>
  std::optional<WaitingCloud> takeIf(Ready&& ready) {
    for (auto place = clouds_.begin(); place != clouds_.end(); ++place) {
      if (ready(*place)) return pop(place);
    }
    return std::nullopt;
  }

 private:
  std::optional<WaitingCloud> pop(std::deque<WaitingCloud>::iterator place) {
    WaitingCloud cloud = std::move(*place);
    clouds_.erase(place);
    return cloud;
  }

  std::deque<WaitingCloud> clouds_;
};

}  // namespace bki_mapping::ros_shell
