/// @file Compares the points that a map keeps with a ground-truth cloud, as the DynamicMap benchmark does
/// (Zhang et al., "A Dynamic Points Removal Benchmark in Point Cloud Maps", ITSC 2023).
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "bki_mapping/core/scan.h"
#include "bki_mapping/rules/state_rules.h"
#include "evaluation/dynamics_evaluation.h"
#include "simulation/truth_cloud.h"

namespace bki_mapping {

/// Finds the nearest of many points.
class NearestPoints {
 public:
  /// @param points finite.
  explicit NearestPoints(const std::vector<Eigen::Vector3f>& points);
  ~NearestPoints();
  NearestPoints(NearestPoints&&) noexcept;
  /// The position of the nearest point; nullopt if none is within `distance`. May be called in many threads.
  std::optional<std::size_t> find(const Eigen::Vector3f& point, float distance) const;

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

struct CloudQuality : Accuracies {
  double distance = 0.0;           ///< within which points match [m]
  std::size_t cleaned_points = 0;  ///< points that the map keeps
  std::size_t not_finite = 0;      ///< points of the truth that do not count
};

/// A point of the truth counts as kept if a point of the cleaned cloud is within `distance`, otherwise as
/// removed; what the cleaned cloud has beyond the truth does not count. @param cleaned relative to the origin
/// of the truth.
CloudQuality compareClouds(const TruthCloud& truth, const std::vector<Eigen::Vector3f>& cleaned,
                           double distance);

/// Collects the points of a drive, and compares those that lie in occupied voxels in the end with the truth.
class CloudEvaluation {
 public:
  /// @param truth if given, a cloud of the drive; otherwise it is made of the scans by TruthCloud::add.
  /// @param distance within which points match [m].
  CloudEvaluation(std::optional<TruthCloud> truth, double distance);

  void add(const Scan& scan);
  /// The points of a scan that are in the truth, with raw labels: 252 for those that move there, otherwise 0.
  Scan labelled(const Scan& scan) const;
  CloudQuality compare(const SemanticMap& map, const StateRules& rules) const;

 private:
  TruthCloud truth_;
  std::optional<NearestPoints> nearest_in_truth_;  ///< if the truth was given
  double distance_;
  std::vector<Eigen::Vector3f> points_;  ///< of all scans, relative to the origin of truth_ [m]
};

}  // namespace bki_mapping
