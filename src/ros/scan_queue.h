/// @file The queue of clouds that wait for their transforms or for the mapper. MappingServer::processQueue
/// drops those whose transform does not come within tf_timeout.
#pragma once

#include <sensor_msgs/PointCloud2.h>

#include <chrono>
#include <deque>
#include <optional>

#include "ros/point_times.h"

namespace bki_mapping::ros_interface {

/// Which cloud a full queue drops.
enum class QueuePolicy { kDropOldest, kDropNewest };

struct WaitingCloud {
  sensor_msgs::PointCloud2ConstPtr cloud;
  std::size_t input = 0;                                ///< index of the server's input that received it
  std::chrono::steady_clock::time_point received = {};  ///< time of reception
  std::optional<TimeValues> times = {};                 ///< what ScanReader::ready has read of the cloud
};

/// A bounded queue. Clouds leave it in order of reception; one that is not ready does not block later ones.
class ScanQueue {
 public:
  std::size_t size() const { return clouds_.size(); }

  /// Adds a cloud. @return the cloud dropped by the policy if there would be more than `max_size`.
  std::optional<WaitingCloud> push(WaitingCloud cloud, std::size_t max_size, QueuePolicy policy) {
    if (clouds_.size() >= max_size && policy == QueuePolicy::kDropNewest) return cloud;
    clouds_.push_back(std::move(cloud));
    return clouds_.size() > max_size ? pop(clouds_.begin()) : std::nullopt;
  }

  /// Removes and returns the first cloud for which ready(cloud) is true.
  template <typename Ready>
  std::optional<WaitingCloud> takeIf(Ready&& ready) {
    for (auto cloud = clouds_.begin(); cloud != clouds_.end(); ++cloud) {
      if (ready(*cloud)) return pop(cloud);
    }
    return std::nullopt;
  }

 private:
  std::optional<WaitingCloud> pop(std::deque<WaitingCloud>::iterator position) {
    WaitingCloud cloud = std::move(*position);
    clouds_.erase(position);
    return cloud;
  }

  std::deque<WaitingCloud> clouds_;
};

}  // namespace bki_mapping::ros_interface
