/// @file Settings of the mapping server: the mapper's and ROS's own, from the parameter server.
#pragma once

#include <ros/node_handle.h>

#include <limits>
#include <map>
#include <string>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/query/column_map.h"
#include "ros/distance_section_config.h"
#include "ros/input_config.h"
#include "ros/scan_queue.h"
#include "ros/time_watch.h"

namespace bki_mapping::ros_interface {

/// The journal of scans, and corrected poses.
struct CorrectionConfig {
  bool journal = false;            ///< whether scans are kept, so that they can move
  double journal_quantum = 0.0;    ///< to which points are rounded in the sensor's frame [m]; 0: as usual
  double journal_limit = 4000.0;   ///< of the memory of kept scans [MB]; 0: none
  double tolerance = -1.0;         ///< by which points may be off [m]; < 0: a tenth of the resolution
  std::string corrected_frame_id;  ///< whose poses corrected_path has; "": the sensor's
  std::string odometry_frame_id;   ///< in which poses do not jump; "": not known
};

enum class ColorMode { kSemantics, kProbability, kVariance, kHeight };

struct ServerConfig {
  std::string frame_id = "map";            ///< the map frame
  std::string classes = "semantic_kitti";  ///< name of a class table, or a file
  std::string config;                      ///< name of a preset, or a file of parameters; "": none
  double tf_timeout = 0.5;                 ///< how long a cloud waits for its transform [s of wall time]
  int queue_size = 10;                     ///< most clouds that wait
  QueuePolicy queue_policy = QueuePolicy::kDropOldest;
  OnTimeJump on_time_jump = OnTimeJump::kKeep;
  double window = 0.0;             ///< edge of the cube around the sensor that is kept in memory [m]; 0: all
  std::string map_file;            ///< where the map is kept, or the folder of a city; "": nowhere
  std::string own_map_file;        ///< where the map is kept if map_file is a city; "": nowhere
  double map_load_radius = 60.0;   ///< distance up to which tiles of a city are loaded [m]
  bool read_only = false;          ///< whether map_file is published and not changed
  double save_period = 60.0;       ///< [s]; 0: map_file is saved only at the end
  double diagnostic_period = 1.0;  ///< [s]
  double publish_rate = 2.0;       ///< highest rate of each map topic [Hz]
  double view_min_z = -1e6;        ///< lowest height that markers and voxel_cloud show [m]
  double view_max_z = 1e6;         ///< greatest [m]
  double view_range = 0.0;         ///< distance that markers and voxel_cloud show [m]; 0: all
  bool latch = false;              ///< whether map topics are latched
  ColorMode color_mode = ColorMode::kSemantics;
  double occupancy_min_z = -1e6;  ///< of projected_map [m]
  double occupancy_max_z = 1e6;   ///< of projected_map [m]
  HeightReference occupancy_height = HeightReference::kMap;
  bool full_projected_map = false;  ///< whether projected_map is sent whole each time
  DistanceSectionConfig distance_section;
  CorrectionConfig correction;
  /// What inputs do not set for themselves; the only input where `inputs` names none.
  InputConfig input;
  /// Settings of each named input, by name: parameter and value. See allInputs.
  std::map<std::string, std::map<std::string, std::string>> inputs;
};

/// The inputs with all their settings. What an input does not set comes from `server.input`, its ranges from
/// `mapper.sensor_model`.
std::vector<InputConfig> allInputs(const ServerConfig& server, const MapperConfig& mapper);

/// The server's own parameters; the mapper's are in mapping/mapper_config.h.
std::vector<NamedParameter<ServerConfig>> serverParameters();

/// Reads all parameters of a private namespace, and those of the file `config` that the namespace lacks.
/// @throws std::invalid_argument that names every unknown parameter and every value not allowed, or the
/// fault of the file.
void readParameters(const ros::NodeHandle& private_node, ServerConfig& server, MapperConfig& mapper);

/// The same from names and text.
void setParameters(const std::map<std::string, std::string>& values, ServerConfig& server,
                   MapperConfig& mapper);

}  // namespace bki_mapping::ros_interface
