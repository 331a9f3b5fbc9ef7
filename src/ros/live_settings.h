/// @file Settings that change while the mapper runs, through dynamic_reconfigure.
#pragma once

#include <bki_mapping/MappingConfig.h>
#include <dynamic_reconfigure/Config.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ros/reconfigure_server.h"
#include "ros/server_config.h"

namespace bki_mapping::ros_interface {

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
