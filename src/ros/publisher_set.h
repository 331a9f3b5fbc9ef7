/// @file PublisherSet, the publishers of all map topics: decides when each of them publishes.
#pragma once

#include <ros/callback_queue.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "ros/map_publisher.h"

namespace bki_mapping::ros_interface {

/// The time from the start of one publication of a topic to the next: 1 / rate, but at least ten times what
/// the last one took, so that no topic takes more than a tenth of the time.
/// @param rate publish_rate [Hz]. @param took duration of the last publication.
std::chrono::duration<double> publishPeriod(double rate, std::chrono::duration<double> took);

/// Owns the publishers and their thread, in which they work on snapshots: mapping goes on meanwhile. The
/// thread has a lower priority than mapping. Each publisher publishes changes at most publish_rate times a
/// second, and takes at most a tenth of the time, however large the map.
class PublisherSet {
 public:
  using TakeSnapshot = std::function<std::shared_ptr<const ServerSnapshot>()>;

  /// @param take_snapshot called in the thread of the publishers; asks the mapping thread to call
  /// closeChanges() and to make a snapshot.
  PublisherSet(const ros::NodeHandle& node, const ServerConfig& config, TakeSnapshot take_snapshot);
  ~PublisherSet() { stop(); }

  /// Starts the thread.
  void start();
  /// Ends the thread. Until then take_snapshot must answer, or throw.
  void stop();
  /// Records blocks that were changed, created or erased. For the mapping thread, as closeChanges().
  void changed(const std::vector<GridIndex>& blocks);
  /// Separates the changes recorded so far, which the next snapshot contains, from later ones.
  void closeChanges();
  /// Makes every publisher send the whole map again. For any thread.
  void startOver();

 private:
  using Clock = std::chrono::steady_clock;

  void work();
  void wake();
  /// Takes a snapshot, and passes the changes that it contains on to the publishers.
  std::shared_ptr<const ServerSnapshot> takeSnapshot();
  /// The topics that are due. Drops the changes if nobody listens to any topic.
  std::vector<MapPublisher*> findDue();
  void publishDue();

  ros::CallbackQueue queue_;
  ros::NodeHandle node_;
  TakeSnapshot take_snapshot_;
  std::vector<std::unique_ptr<MapPublisher>> publishers_;

  std::mutex mutex_;  ///< of what follows
  ChangedBlocks changed_, closed_;
  /// A request after the snapshot was taken is for the next one: as after a reset.
  bool start_over_ = false, closed_start_over_ = false;

  std::atomic<bool> running_{false};
  std::thread thread_;
};

}  // namespace bki_mapping::ros_interface
