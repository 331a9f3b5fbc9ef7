/// @file What publishers and services know of the map.
#pragma once

#include <geometry_msgs/Pose.h>
#include <std_msgs/Header.h>

#include <algorithm>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/rules/map_snapshot.h"
#include "parallel/thread_pool.h"
#include "ros/server_config.h"

namespace bki_mapping::ros_interface {

/// The pose of the sensor at an integrated scan, in the map frame.
struct SensorPose {
  ros::Time stamp;
  geometry_msgs::Pose pose;
};

/// The state of the server between two scans, from which messages and files are made in other threads.
struct ServerSnapshot : MapSnapshot {
  std_msgs::Header header;             ///< map frame, stamp of the last scan
  const ClassTable& classes;           ///< the server's; never changes
  std::vector<SensorPose> trajectory;  ///< in the order of integration
  ServerConfig config;
  Eigen::Vector3d sensor;  ///< origin of the last scan, map frame [m]
  int threads = 0;         ///< setting `threads` of the mapper

  /// The number of threads that write a message. More than a few do not help: memory limits them.
  /// @param blocks of which the message is made; few are not worth the start of threads.
  int threadsFor(std::size_t blocks) const {
    constexpr std::size_t kManyBlocks = 256;
    constexpr int kMostThreads = 4;
    return blocks < kManyBlocks ? 1 : std::min(threadCount(threads), kMostThreads);
  }

  /// Whether a cube is within view_range of the sensor; true without such a limit.
  /// @param edge of the cube [m].
  bool inView(const Eigen::Vector3d& centre, double edge) const {
    const double beyond = (centre - sensor).cwiseAbs().maxCoeff() - 0.5 * edge;
    return config.view_range <= 0.0 || beyond <= config.view_range;
  }
  /// Whether a height is between view_min_z and view_max_z.
  bool heightInView(double z) const { return z >= config.view_min_z && z <= config.view_max_z; }
  bool inView(const BlockIndex& block) const {
    return inView(map.geometry().blockCentre(block), map.geometry().blockSize());
  }
};

}  // namespace bki_mapping::ros_interface
