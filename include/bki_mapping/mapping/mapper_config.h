/// @file All settings of the mapper, their defaults, and their names as parameters.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/free_space/free_space_config.h"
#include "bki_mapping/kernel/kernel_config.h"
#include "bki_mapping/rules/rules_config.h"
#include "bki_mapping/rules/scan_limit_config.h"
#include "bki_mapping/rules/scan_rules.h"

namespace bki_mapping {

enum class UnlabelledPoints { kOccupied, kIgnore };
enum class UnknownLabels { kIgnore, kUnlabelled };

struct MapperConfig {
  double resolution = 0.3;             ///< edge of a voxel [m]
  double prior = 0.001;                ///< alpha0, concentration of each class before any scan
  double downsample_resolution = 0.1;  ///< edge of a down-sampling cell [m]; 0: off
  int threads = 0;                     ///< 0: all cores
  double memory_limit = 0.0;           ///< of the map [MB]; a scan that would exceed it is refused; 0: none
  KernelConfig kernel;
  FreeSpaceConfig free_space;
  RulesConfig rules;
  ScanRules scan_rules;  ///< follow from `rules` if these are enabled; no parameters
  ScanLimitConfig scan_limit;
  SensorModelConfig sensor_model;
  bool clear_beyond_max_range = true;  ///< beams of hits beyond max_range clear space up to there
  OcclusionExtent occlusion = OcclusionExtent::kNone;
  UnlabelledPoints unlabelled_points = UnlabelledPoints::kOccupied;
  UnknownLabels unknown_labels = UnknownLabels::kIgnore;
  LabelValues label_values = LabelValues::kRaw;
};

/// The settings that apply, which are others than those given if rules.enabled: evidence counts scans, so
/// that prior, kernel.scale and scan_rules follow from the rules, and down-sampling cells divide a voxel into
/// whole parts, at least two along each edge, of about downsample_resolution.
MapperConfig applied(const MapperConfig& config);

using Parameter = NamedParameter<MapperConfig>;

/// All parameters of the mapper in the order of the documentation. Those of a component are defined in its
/// room, in `*_parameters.h`.
std::vector<Parameter> mapperParameters();

/// setNamedParameters() for the mapper's parameters.
void setParameters(MapperConfig& config, const std::map<std::string, std::string>& values);

/// checkNamedParameters() for the mapper's parameters.
void checkParameters(const MapperConfig& config);

/// @throws std::invalid_argument that names a parameter that differs but can change only at the start.
void checkChanges(const MapperConfig& before, const MapperConfig& after);

/// One sentence for each setting that is allowed but probably not intended.
std::vector<std::string> settingWarnings(const MapperConfig& config);
/// The same, and one for settings that do not suit the class table.
std::vector<std::string> settingWarnings(const MapperConfig& config, const ClassTable& classes);

}  // namespace bki_mapping
