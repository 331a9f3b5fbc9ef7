/// @file The settings that say where the map of a server is kept: map_file, own_map_file, read_only, window.
#pragma once

#include <string>

#include "ros/server_config.h"

namespace bki_mapping::ros_interface {

/// @throws std::invalid_argument, with the remedy, if these settings contradict each other.
void checkMapFileSettings(const ServerConfig& config);

}  // namespace bki_mapping::ros_interface
