/// @file The figures of evaluate_map as a table and as JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "evaluation/cloud_evaluation.h"
#include "evaluation/dynamics_evaluation.h"
#include "evaluation/occupancy_evaluation.h"
#include "evaluation/presence_evaluation.h"
#include "evaluation/scan_timer.h"
#include "evaluation/semantic_evaluation.h"
#include "evaluation/trace_evaluation.h"
#include "evaluation/truth_evaluation.h"

namespace bki_mapping {

/// The same map, with its states decided by other settings.
struct JudgedMap {
  std::string settings;  ///< as given
  DynamicsQuality dynamics;
};

/// The same scans in a map with other settings or rules.
struct OtherMap {
  std::string settings;  ///< as given
  DynamicsQuality dynamics;
  PresenceQuality presence;
  std::optional<TruthQuality> truth;  ///< without ghosts
  std::size_t bytes = 0;              ///< of memory
};

/// What a simulated drive leaves of what is not there.
struct TracesOfKinds {
  TraceQuality particles, images;
};

/// The same scans in an OctoMap.
struct OctomapQuality {
  std::string settings;  ///< as given
  DynamicsQuality dynamics;
  PresenceQuality presence;
  Reliability occupancy;
  std::optional<TruthQuality> truth;  ///< what needs no classes
  std::optional<TracesOfKinds> traces;
  ScanTime median;        ///< of a scan
  std::size_t bytes = 0;  ///< of memory
};

struct MapQuality {
  DynamicsQuality dynamics;
  std::vector<JudgedMap> judged;
  std::vector<OtherMap> others;
  PresenceQuality presence;
  SemanticQuality semantics;
  Reliability occupancy;              ///< by the points, see OccupancyEvaluation
  std::optional<CloudQuality> cloud;  ///< compared with a ground-truth cloud
  std::vector<OctomapQuality> octomaps;
  std::optional<TruthQuality> truth;               ///< only for simulated drives
  std::optional<TracesOfKinds> traces;             ///< likewise
  std::map<ClassId, std::size_t> voxels_by_class;  ///< occupied ones
  ScanTime median, yardstick;                      ///< of a scan, and of the yardstick on the same scans
  std::size_t bytes = 0;                           ///< of memory
  bool labels_are_ids = false;                     ///< so that it is unknown what moves
  std::size_t labels = 0, unknown_labels = 0;      ///< labels of all points; those not in the class table
  std::uint32_t unknown_label = 0;                 ///< an example of the latter
};

/// A table with one figure per line and its meaning; "-" for fractions of nothing.
std::string qualityTable(const MapQuality& quality, const ClassTable& classes);

/// JSON; docs/files.md describes it. Fractions of nothing are null.
std::string qualityJson(const MapQuality& quality, const ClassTable& classes);

}  // namespace bki_mapping
