/// @file A dynamic_reconfigure server that hears of every value as it was sent.
#pragma once

#include <bki_mapping/MappingConfig.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/node_handle.h>

#include <functional>
#include <mutex>

namespace bki_mapping::ros_interface {

/// Serves dynamic_reconfigure's clients in the namespace `~reconfigure`, also with the values on the
/// parameter server. dynamic_reconfigure::Server would clamp values to the limits that clients show, and
/// leave out unknown names, before its owner sees them.
class ReconfigureServer {
 public:
  /// Makes a change, or does not. @return the configuration in force afterwards.
  using Change = std::function<MappingConfig(const dynamic_reconfigure::Config& asked)>;

  /// @param config in force at the start.
  ReconfigureServer(ros::NodeHandle private_node, const MappingConfig& config, Change change);

 private:
  void publish(const MappingConfig& config);
  bool onSet(dynamic_reconfigure::Reconfigure::Request& request,
             dynamic_reconfigure::Reconfigure::Response& response);

  ros::NodeHandle values_;  ///< where the parameter server has them
  Change change_;
  std::mutex mutex_;  ///< one change at a time
  ros::Publisher descriptions_, updates_;
  ros::ServiceServer service_;
};

/// Checks that a message names only settings that `known` has, each once and with its type.
/// @throws std::invalid_argument that names those at fault.
void checkSettings(const dynamic_reconfigure::Config& asked, const MappingConfig& known);

}  // namespace bki_mapping::ros_interface
