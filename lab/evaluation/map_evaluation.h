/// @file All measures of one map.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "evaluation/cloud_evaluation.h"
#include "evaluation/dynamics_evaluation.h"
#include "evaluation/occupancy_evaluation.h"
#include "evaluation/octomap_mapper.h"
#include "evaluation/presence_evaluation.h"
#include "evaluation/quality_report.h"
#include "evaluation/scan_timer.h"
#include "evaluation/semantic_evaluation.h"
#include "evaluation/trace_evaluation.h"
#include "evaluation/truth_evaluation.h"

namespace bki_mapping {

/// Follows what is not there on a simulated drive.
struct TracesEvaluation {
  explicit TracesEvaluation(const GridGeometry& geometry);
  void add(const Scan& scan, Occupants& map);
  TracesOfKinds quality(Occupants& map) const { return {particles.quality(map), images.quality(map)}; }
  TraceEvaluation particles, images;
};

/// Another map of the same scans, in a grid of the same kind, and what only it has.
struct OtherRun {
  OtherRun(std::string given, const MapperConfig& config, std::shared_ptr<const ClassTable> classes,
           const KittiLabels& moving);
  std::string settings;  ///< as given
  SemanticMapper mapper;
  PresenceEvaluation presence;
};

/// An OctoMap of the same scans, and what only it has.
struct OctomapRun {
  OctomapRun(const std::string& given, const GridGeometry& geometry, const KittiLabels& moving);
  std::string settings;  ///< as given
  OctomapMapper mapper;
  PresenceEvaluation presence;
  TracesEvaluation traces;
  ScanTimes times;
};

/// The measures of one run. Must stay where it is from tellTruth() on.
struct MapEvaluation {
  /// @param scans number of scans of the run. @param late as in DynamicsEvaluation.
  MapEvaluation(const GridGeometry& geometry, const KittiLabels& moving, std::size_t scans, std::size_t late,
                std::optional<CloudEvaluation> ground_truth_cloud);
  MapEvaluation(const MapEvaluation&) = delete;
  MapEvaluation& operator=(const MapEvaluation&) = delete;

  DynamicsEvaluation dynamics;
  PresenceEvaluation presence;
  SemanticEvaluation semantics;
  OccupancyEvaluation occupancy;
  std::optional<TruthEvaluation> truth;
  std::optional<TracesEvaluation> traces;  ///< of a simulated drive
  std::optional<CloudEvaluation> cloud;
  std::list<OtherRun> others;
  std::list<OctomapRun> octomaps;
  double end = 0.0;  ///< time of the last scan since the start of the drive [s]
  std::size_t labels = 0, unknown_labels = 0;
  std::uint32_t unknown_label = 0;

  /// @param predicted the labels given to the mapper.
  void add(const Scan& scan, const std::vector<std::uint32_t>& predicted, const ClassTable& classes);
  /// The same for a scan without labels: the ground-truth cloud, if there is one, says what moves.
  void addUnlabelled(const Scan& scan, const ClassTable& classes);
  /// Whether a voxel contains an object that can move at the end of the drive, if the truth is known.
  DynamicsEvaluation::Taken taken() const;
  /// Call once `truth`, `others` and `octomaps` are there.
  void tellTruth();
  MapQuality compare(const SemanticMapper& mapper);
  /// One row per voxel with points: its centre and its outcome.
  std::string fateRows(const GridGeometry& geometry, Occupants& map) const;
  /// The same with all other errors, which come last, so that they are drawn on top.
  std::string errorRows(const SemanticMapper& mapper) const;

 private:
  void addPoints(const Scan& scan);
};

}  // namespace bki_mapping
