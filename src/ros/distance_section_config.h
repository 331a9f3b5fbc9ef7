/// @file Settings of the topic distance_section.
#pragma once

#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/query/distance_field.h"

namespace bki_mapping::ros_interface {

struct DistanceSectionConfig {
  double height = 0.0;        ///< of the section above the sensor [m]
  double range = 15.0;        ///< from the sensor to the nearest edge of the section, at least [m]
  double max_distance = 3.0;  ///< up to which distances are told apart [m]
  std::string classes;        ///< names of the classes that are obstacles, with commas between them
  bool unknown = false;       ///< whether unknown space is an obstacle
};

/// The rows of distance_section/...
std::vector<NamedParameter<DistanceSectionConfig>> distanceSectionParameters();

/// What is an obstacle for distance_section: without names, the classes that are obstacles for projected_map.
/// @throws std::invalid_argument if the table lacks one of the names.
ObstacleRules obstaclesOf(const DistanceSectionConfig& config, const ClassTable& table);

}  // namespace bki_mapping::ros_interface
