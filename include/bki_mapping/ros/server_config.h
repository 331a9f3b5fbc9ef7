/// @file Settings of the mapping server: the mapper's and ROS's own, from the parameter server.
#pragma once

#include <ros/node_handle.h>

#include <limits>
#include <map>
#include <string>
#include <vector>

#include "bki_mapping/core/config.h"
#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_shell {

enum class ColorMode { kSemantics, kProbability, kVariance, kHeight };

struct ServerConfig {
  std::string frame_id = "map";            ///< the map frame
  std::string label_field = "label";       ///< field of clouds with labels; "": every point has label 0
  std::string classes = "semantic_kitti";  ///< name of a class table, or a file
  double tf_timeout = 0.5;                 ///< how long a cloud waits for its transform [s of wall time]
  int queue_size = 10;                     ///< clouds that may wait
  double publish_rate = 2.0;               ///< maps a second, at most [Hz]
  bool latch = false;                      ///< whether map topics are latched
  ColorMode color_mode = ColorMode::kSemantics;
  double occupancy_min_z = -1e6;  ///< of projected_map [m]
  double occupancy_max_z = 1e6;   ///< of projected_map [m]
};

/// The server's own parameters (the mapper's are in core/parameters.h).
std::vector<NamedParameter<ServerConfig>> serverParameters();

/// Reads all parameters of a private namespace.
/// @throws std::invalid_argument that names every unknown parameter and every value not allowed.
void readParameters(const ros::NodeHandle& private_node, ServerConfig& server, MapperConfig& mapper);

/// The same from names and text.
void setParameters(const std::map<std::string, std::string>& values, ServerConfig& server,
                   MapperConfig& mapper);

}  // namespace bki_mapping::ros_shell
