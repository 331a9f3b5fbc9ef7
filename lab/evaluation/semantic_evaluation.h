/// @file Measures the classes of a map, and how well its probabilities and variances predict errors.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/rules/voxel_state.h"
#include "evaluation/reliability.h"
#include "simulation/truth_cloud.h"

namespace bki_mapping {

/// Confusion matrix of points. The predicted class kFreeClass means: not occupied, or of no class.
class Confusion {
 public:
  void add(ClassId truth, ClassId predicted, std::size_t points = 1) {
    counts_[{truth, predicted}] += points;
  }
  std::size_t count(ClassId truth, ClassId predicted) const;
  std::size_t points(ClassId truth) const;  ///< of this true class

  /// Intersection over union of a class. NaN if the class is neither true nor predicted for any point.
  double iou(ClassId id) const;
  /// Mean IoU over the classes that are true for some point. NaN without points.
  double meanIou() const;
  /// Fraction of the points whose predicted class is the true one. NaN without points.
  double accuracy() const;

 private:
  std::map<std::pair<ClassId, ClassId>, std::size_t> counts_;
};

/// Accuracy of the map, and of the labels given to the mapper, at the labelled points (protocol of Gan et
/// al., RA-L 2020: the final map is compared with the ground truth at every point that is not unlabelled).
struct SemanticQuality {
  Confusion map;    ///< predicted by the voxel that contains the point
  Confusion input;  ///< predicted by the label given to the mapper
  /// The same without the points of what has moved away: clearing these is right.
  Confusion map_of_present, input_of_present;
  /// Of these, the points in occupied voxels: what the map says of all that it keeps.
  Confusion map_of_occupied, input_of_occupied;

  // Over the points in occupied voxels:
  Reliability probability;        ///< of p, the class's share of the whole posterior, `free` included
  Reliability class_probability;  ///< of C, the probability of the class alone

  /// Area under the sparsification error curve (AUSE; Ilg et al., ECCV 2018). Removing the voxels with the
  /// largest variance first leaves more errors than removing those with the most errors first; this is the
  /// difference of the error rates, averaged over all fractions removed. 0: variance ranks errors perfectly.
  double sparsification_error = 0.0;
};

/// Counts labelled points in each voxel, and compares a map with them.
class SemanticEvaluation {
 public:
  /// @param moving raw labels of objects that move.
  explicit SemanticEvaluation(const GridGeometry& geometry, KittiLabels moving = {})
      : geometry_(geometry), moving_(std::move(moving)) {}

  /// Adds the points of a scan. Skips those that are not finite, unlabelled, or have a true label outside of
  /// the class table. Ids of the class table do not say what moves.
  /// @param predicted the labels given to the mapper, one for each of scan.labels, which are the true ones.
  void add(const Scan& scan, const std::vector<std::uint32_t>& predicted, const ClassTable& classes);

  /// Whether something that can move is in a voxel at the end.
  using StillThere = std::function<bool(const VoxelIndex&)>;

  /// @param still_there may be empty: all is.
  SemanticQuality compare(const SemanticMap& map, const StateRules& rules,
                          const StillThere& still_there = {}) const;
  /// Occupied voxels whose class is not the true one of any point in them.
  std::vector<VoxelIndex> wrongVoxels(const SemanticMap& map, const StateRules& rules) const;

 private:
  /// Points of one voxel that have all of this in common.
  struct Points {
    ClassId truth, predicted;
    bool moving;
    std::uint32_t count;
  };

  GridGeometry geometry_;
  KittiLabels moving_;
  GridTable index_of_;
  std::vector<VoxelIndex> voxels_;
  std::vector<std::vector<Points>> points_;  ///< in each voxel
};

}  // namespace bki_mapping
