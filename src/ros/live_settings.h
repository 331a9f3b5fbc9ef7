/// @file Settings that change while the mapper runs, through dynamic_reconfigure.
#pragma once

#include <bki_mapping/MappingConfig.h>
#include <dynamic_reconfigure/Config.h>
#include <dynamic_reconfigure/Reconfigure.h>
#include <ros/node_handle.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "ros/server_config.h"

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

/// Parameters that clients see although they cannot change while mapping; a change of one is refused.
inline const std::vector<std::string>& shownAtStart() {
  static const std::vector<std::string> names = {"resolution", "frame_id", "classes"};
  return names;
}

/// Setting that reports lastRefusal: dynamic_reconfigure has no other way to report a refusal.
constexpr char kLastRefusal[] = "last_refusal";

/// Offers the parameters of cfg/Mapping.cfg in the namespace `~reconfigure`, which keeps the values that
/// dynamic_reconfigure writes to the parameter server apart from the parameters read at the start.
class LiveSettings {
 public:
  /// Applies new settings. @throws std::invalid_argument if they are not allowed.
  using Apply = std::function<void(const ServerConfig&, const MapperConfig&)>;

  /// @param answered called after each change was applied or refused.
  LiveSettings(const ros::NodeHandle& private_node, const ServerConfig& server, const MapperConfig& mapper,
               Apply apply, std::function<void()> answered);

  /// Why the last change was refused; "" if it was applied.
  const std::string& lastRefusal() const { return last_refusal_; }

  /// The dynamic_reconfigure configuration of the given settings.
  static MappingConfig show(const ServerConfig& server, const MapperConfig& mapper);
  /// Sets the settings of a configuration. @throws std::invalid_argument if a value is not allowed, or if a
  /// parameter differs that cannot change while mapping.
  static void take(const MappingConfig& from, ServerConfig& server, MapperConfig& mapper);

 private:
  MappingConfig onChange(dynamic_reconfigure::Config asked);

  ServerConfig server_;
  MapperConfig mapper_;
  Apply apply_;
  std::function<void()> answered_;
  std::string last_refusal_;
  std::unique_ptr<ReconfigureServer> offered_;
};

}  // namespace bki_mapping::ros_interface
