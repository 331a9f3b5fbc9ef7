/// @file The services that answer queries of the map: their threads. queries/queries.h lists them.
#pragma once

#include <ros/callback_queue.h>
#include <ros/ros.h>

#include <string>
#include <vector>

#include "ros/recent_map.h"

namespace bki_mapping::ros_interface {

/// Answers queries on snapshots, in threads of its own: neither does mapping wait for queries, nor do
/// queries wait for a scan (RecentMap).
class QueryServices {
 public:
  /// @param node holds the services. @param mapping the queue that the mapping thread serves.
  /// @param take takes a snapshot; called in the mapping thread.
  QueryServices(const ros::NodeHandle& node, ros::CallbackQueue& mapping, RecentMap::Take take);

  /// Starts the threads.
  void start() {
    background_thread_.start();
    threads_.start();
  }
  /// Ends the threads. Until then the mapping queue must be served.
  void stop() {
    threads_.stop();
    background_thread_.stop();
  }
  /// For the mapping thread, which reports changes.
  RecentMap& map() { return map_; }

 private:
  template <typename Service>
  void offer(const std::string& name);

  ros::CallbackQueue queue_;
  ros::CallbackQueue background_;  ///< frees snapshots, which would pile up in memory behind long queries
  ros::NodeHandle node_;
  RecentMap map_;
  std::vector<ros::ServiceServer> services_;
  // More than one, so that a small query need not wait for a large one.
  ros::AsyncSpinner threads_{2, &queue_};
  ros::AsyncSpinner background_thread_{1, &background_};
};

}  // namespace bki_mapping::ros_interface
