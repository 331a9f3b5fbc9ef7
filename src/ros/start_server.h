/// @file Starts the mapping server, for node and nodelet, which need not read its header: that takes the
/// compiler long.
#pragma once

#include <ros/node_handle.h>

#include <memory>

namespace bki_mapping::ros_interface {

/// A MappingServer, which ends when nobody holds it any more. For the parameters see its constructor.
/// @throws std::invalid_argument if a parameter is unknown or not allowed.
std::shared_ptr<void> startMappingServer(const ros::NodeHandle& node, const ros::NodeHandle& private_node);

}  // namespace bki_mapping::ros_interface
