/// @file Settings that change while the mapper runs, through dynamic_reconfigure.
#pragma once

#include <bki_mapping/MappingConfig.h>
#include <dynamic_reconfigure/server.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "ros/server_config.h"

namespace bki_mapping::ros_shell {

/// Parameters that clients see beside those that change while mapping; a change of one is refused.
inline const std::vector<std::string>& shownAtStart() {
  static const std::vector<std::string> names = {"resolution", "frame_id", "classes"};
  return names;
}

/// Name of the setting that holds lastRefusal: a server of dynamic_reconfigure can refuse in no other way.
constexpr char kLastRefusal[] = "last_refusal";

/// Offers the parameters of cfg/Mapping.cfg in the namespace `~reconfigure`, so that what dynamic_reconfigure
/// writes to the parameter server does not mix with parameters read at the start.
class LiveSettings {
 public:
  /// Takes over new settings. @throws std::invalid_argument if it cannot.
  using Apply = std::function<void(const ServerConfig&, const MapperConfig&)>;

  /// @param answered called when a change was taken over or refused.
  LiveSettings(const ros::NodeHandle& private_node, const ServerConfig& server, const MapperConfig& mapper,
               Apply apply, std::function<void()> answered);

  /// Why the last change was refused; "" if it was not.
  const std::string& lastRefusal() const { return last_refusal_; }

  /// A configuration with the given settings.
  static MappingConfig show(const ServerConfig& server, const MapperConfig& mapper);
  /// Sets what a configuration says. @throws std::invalid_argument if a value is not allowed, or the name of
  /// one that cannot change.
  static void take(const MappingConfig& from, ServerConfig& server, MapperConfig& mapper);

 private:
  void onChange(MappingConfig& config);

  ServerConfig server_;
  MapperConfig mapper_;
  Apply apply_;
  std::function<void()> answered_;
  std::string last_refusal_;
  boost::recursive_mutex mutex_;  ///< of offered_
  std::unique_ptr<dynamic_reconfigure::Server<MappingConfig>> offered_;
};

}  // namespace bki_mapping::ros_shell
