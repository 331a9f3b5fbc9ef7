/// @file What the publishers of map topics have in common.
#pragma once

#include <geometry_msgs/PoseStamped.h>
#include <ros/node_handle.h>
#include <std_msgs/Header.h>

#include <functional>
#include <memory>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/ros/server_config.h"

namespace bki_mapping::ros_shell {

/// The state of a server that publishers show.
struct MapSnapshot {
  std_msgs::Header header;  ///< map frame, stamp of the last scan
  const SemanticMapper& mapper;
  const std::vector<geometry_msgs::PoseStamped>& trajectory;  ///< sensor poses of all integrated scans
};

/// Publishes one topic. Messages are built only while somebody listens.
class MapPublisher {
 public:
  virtual ~MapPublisher() = default;
  bool wanted() const { return publisher_.getNumSubscribers() > 0; }
  virtual void publish(const MapSnapshot& snapshot) = 0;

 protected:
  ros::Publisher publisher_;
};

/// What a publisher is made from.
struct PublisherContext {
  ros::NodeHandle& node;
  const ServerConfig& config;
  std::function<void()> on_connect;  ///< to be called when somebody starts to listen

  template <typename Message>
  ros::Publisher advertise(const std::string& topic) const {
    const auto connected = [call = on_connect](const ros::SingleSubscriberPublisher&) { call(); };
    return node.advertise<Message>(topic, 1, connected, ros::SubscriberStatusCallback(), ros::VoidConstPtr(),
                                   config.latch);
  }
};

/// One of each map topic: the registry of publishers.
std::vector<std::unique_ptr<MapPublisher>> makePublishers(const PublisherContext& context);

std::unique_ptr<MapPublisher> makeOccupiedCells(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeFreeCells(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeVoxelCloud(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeProjectedMap(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeOccupancy(const PublisherContext& context);
std::unique_ptr<MapPublisher> makeTrajectory(const PublisherContext& context);

}  // namespace bki_mapping::ros_shell
