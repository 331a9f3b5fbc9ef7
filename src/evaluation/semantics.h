/// @file How well a map knows what is where, and whether it knows how sure it is.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/map/map_query.h"

namespace bki_mapping {

/// Counts of points by true and by told class. kFreeClass as told class: not occupied, or no class.
class Confusion {
 public:
  void add(ClassId truth, ClassId told, std::size_t points = 1) { counts_[{truth, told}] += points; }
  std::size_t count(ClassId truth, ClassId told) const;
  std::size_t points(ClassId truth) const;  ///< with this true class

  /// Intersection over union of a class: true and told / true or told. NaN if it is neither.
  double iou(ClassId id) const;
  /// Mean of the IoU of all classes that are true of some point. NaN without points.
  double meanIou() const;
  /// Share of the points whose told class is true. NaN without points.
  double accuracy() const;

 private:
  std::map<std::pair<ClassId, ClassId>, std::size_t> counts_;
};

/// Probabilities that were told, in ten bins of equal width, and how often what they were told of was so.
class Reliability {
 public:
  struct Bin {
    std::size_t count = 0, right = 0;
    double probability = 0.0;  ///< sum over the count
  };

  /// @param right how many of `count` were so.
  void add(double probability, std::size_t count, std::size_t right);
  const std::array<Bin, 10>& bins() const { return bins_; }
  /// Expected calibration error: the mean of |share that is right - mean probability| of the bin. NaN of
  /// none.
  double error() const;

 private:
  std::array<Bin, 10> bins_;
};

/// What a map says of labelled points, and what their own labels said (the protocol of Gan et al., RA-L 2020:
/// the final map at each point of the ground truth, unlabelled ones left out).
struct SemanticQuality {
  Confusion map;    ///< told by the voxel that holds the point
  Confusion input;  ///< told by the label that the mapper was given

  Reliability reliability;  ///< of the probability of the voxel's class, over points in occupied voxels

  /// Area under the sparsification error curve (Ilg et al., ECCV 2018): how much more error is left, on
  /// average over all shares of points left out, if the voxels of greatest variance are left out first, than
  /// if those with the most errors were. 0: variance ranks errors perfectly.
  double sparsificationError = 0.0;
};

/// Collects labelled points voxel by voxel, and compares a map with them.
class SemanticEvaluation {
 public:
  explicit SemanticEvaluation(const GridGeometry& geometry) : geometry_(geometry) {}

  /// Adds the points of a scan. Those that are not finite, or whose true class is none or the unlabelled one,
  /// do not count.
  /// @param told the labels that the mapper was given; as many as scan.labels, which are the true ones.
  void add(const Scan& scan, const std::vector<std::uint32_t>& told, const ClassTable& classes);

  SemanticQuality compare(const SemanticMap& map) const;
  /// The voxels that the map calls occupied by a class that no point in them has.
  std::vector<VoxelIndex> wrongVoxels(const SemanticMap& map) const;

 private:
  GridGeometry geometry_;
  Confusion input_;
  GridTable number_;
  std::vector<VoxelIndex> voxels_;
  std::vector<std::map<ClassId, std::size_t>> points_;  ///< of each voxel, by true class
};

/// Labels with errors: each is replaced, with some probability, by one of another class of the table, drawn
/// evenly; the same seed and stamp draw the same.
/// @param rate probability, 0 to 1.
std::vector<std::uint32_t> withLabelNoise(const Scan& scan, const ClassTable& classes, double rate,
                                          std::uint64_t seed);

}  // namespace bki_mapping
