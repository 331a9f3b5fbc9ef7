/// @file How well a map of a simulated drive tells free from occupied, and how many ghosts it holds.
#pragma once

#include <array>
#include <cstddef>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/map/semantic_map.h"
#include "evaluation/semantics.h"
#include "simulation/voxel_truth.h"

namespace bki_mapping::simulation {

/// How many voxels are so called, and how many of them rightly.
struct Tally {
  std::size_t all = 0, right = 0;
  void add(bool is_right) {
    ++all;
    right += is_right;
  }
  double share() const { return static_cast<double>(right) / static_cast<double>(all); }  ///< NaN of none
};

/// Free and occupied voxels against the truth at the end of the drive.
struct SpaceQuality {
  Tally free_precision;      ///< called free; right if nothing is in them
  Tally free_recall;         ///< crossed by a beam, and nothing is in them; right if called free
  Tally occupied_precision;  ///< called occupied; right if something is in them
  Tally occupied_near;       ///< called occupied; right if something is within a voxel's edge of them
  Tally occupied_recall;     ///< hit by a point, and something is in them; right if called occupied
};

struct TruthQuality {
  /// Upper ends of the distances from the drive by which voxels are told apart [m]; the last has no end.
  static constexpr std::array<double, 3> kDistances{10.0, 20.0, 40.0};
  std::array<SpaceQuality, kDistances.size() + 1> by_distance;
  SpaceQuality all;
  /// Classes of the voxels that were hit or crossed, or are called occupied; kFreeClass for free ones.
  Confusion voxels;
  Reliability occupancy;     ///< 1 - p(free) of the known voxels that were hit or crossed
  std::size_t movable = 0;   ///< voxels that the map calls occupied by a class that can move
  std::size_t ghosts = 0;    ///< of these, where no such thing has been near for half a second
  double mean_ghosts = 0.0;  ///< the mean of the same over the moments that countGhosts was called at

  /// Mean IoU over the classes that are true of some voxel, without `free`.
  double meanIou(const ClassTable& classes) const;
  /// IoU of occupied voxels, whatever their class.
  double occupiedIou(const ClassTable& classes) const;
};

/// Collects which voxels were seen on a drive, and compares a map with the truth.
class TruthEvaluation {
 public:
  /// @param classes must outlive this.
  TruthEvaluation(VoxelTruth truth, const ClassTable& classes)
      : truth_(std::move(truth)), geometry_(truth_.geometry()), classes_(classes) {}

  /// Adds the next scan: all its hits, and the way of every 16th beam.
  void add(const Scan& scan);
  /// Counts the ghosts of this moment. @param time since the start of the drive [s].
  void countGhosts(const SemanticMap& map, double time);
  TruthQuality compare(const SemanticMap& map, double time) const;
  /// The voxels that the map calls occupied by a class that can move, where no such thing has been near for
  /// half a second.
  std::vector<VoxelIndex> ghosts(const SemanticMap& map, double time) const;

 private:
  struct Seen {
    VoxelIndex index;
    bool hit = false, crossed = false;
  };

  Seen& seen(const VoxelIndex& index);
  std::size_t distanceBin(const VoxelIndex& index) const;
  bool isMovable(std::uint32_t raw_label) const;
  bool isGhost(const VoxelIndex& index, double time) const;
  /// The class of what is in a voxel, or kFreeClass.
  ClassId classAt(const VoxelIndex& index, double time) const;

  VoxelTruth truth_;
  GridGeometry geometry_;
  const ClassTable& classes_;
  std::vector<Eigen::Vector3d> origins_;  ///< of all scans
  GridTable number_;
  std::vector<Seen> voxels_;
  std::size_t ghosts_ = 0, moments_ = 0;
};

}  // namespace bki_mapping::simulation
