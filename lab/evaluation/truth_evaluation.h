/// @file Compares a map of a simulated drive with its ground truth: free and occupied voxels, classes,
/// ghosts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/rules/state_rules.h"
#include "evaluation/occupants.h"
#include "evaluation/semantic_evaluation.h"
#include "simulation/voxel_truth.h"

namespace bki_mapping {

/// A number of voxels, and how many of them are classified correctly.
struct Proportion {
  std::size_t total = 0, correct = 0;
  void add(bool is_correct) {
    ++total;
    correct += is_correct;
  }
  double fraction() const {
    return static_cast<double>(correct) / static_cast<double>(total);
  }  ///< NaN of none
};

/// Precision and recall of free and occupied voxels, against the ground truth at the end of the drive.
struct SpaceQuality {
  Proportion free_precision;      ///< of the voxels free in the map, those that are mostly empty
  Proportion free_empty;          ///< of the same, those with nothing in them
  Proportion free_recall;         ///< of the empty voxels crossed by a beam, those free in the map
  Proportion occupied_precision;  ///< of the voxels occupied in the map, those with something in them
  Proportion occupied_near;       ///< of the same, those with something within one voxel's edge
  Proportion occupied_recall;     ///< of the non-empty voxels hit by a point, those occupied in the map
};

struct TruthQuality {
  /// Upper limits of the distance bins [m], measured from the trajectory; the last bin has no limit.
  static constexpr std::array<double, 5> kDistances{10.0, 20.0, 40.0, 60.0, 80.0};
  std::array<SpaceQuality, kDistances.size() + 1> by_distance;
  SpaceQuality all;
  /// Classes of the voxels that were hit or crossed, or are occupied in the map; kFreeClass for free ones.
  Confusion voxels;
  Reliability occupancy;     ///< of occupancy, over known voxels that were hit or crossed
  std::size_t movable = 0;   ///< voxels occupied in the map by a class that can move
  std::size_t ghosts = 0;    ///< of these, those that nothing of such a class has been near for 0.5 s
  double mean_ghosts = 0.0;  ///< mean of `ghosts` over the calls of countGhosts

  /// Mean IoU over the classes that occur in the ground truth, without `free`.
  double meanIou(const ClassTable& classes) const;
  /// IoU of occupied voxels, whatever their class.
  double occupiedIou(const ClassTable& classes) const;
};

/// Collects the voxels seen on a drive, and compares a map with the ground truth there.
class TruthEvaluation {
 public:
  /// @param classes must outlive this.
  TruthEvaluation(simulation::VoxelTruth truth, const ClassTable& classes)
      : truth_(std::move(truth)), geometry_(truth_.geometry()), classes_(classes) {}

  /// Whether something that can move is in a voxel. @param time since the start of the drive [s].
  bool isTaken(const VoxelIndex& index, double time) const;
  /// Adds the next scan: all its hits, and the voxels that every 16th beam crosses.
  void add(const Scan& scan);
  /// Counts the ghosts in the map at a time. @param time since the start of the drive [s].
  void countGhosts(const SemanticMap& map, const StateRules& rules, double time);
  TruthQuality compare(const SemanticMap& map, const StateRules& rules, double time);
  /// The same without ghosts, of a map of any kind. Without classes, `voxels` and `movable` mean nothing.
  TruthQuality compare(const Occupants& map, double time);
  /// The voxels occupied in the map by a class that can move, although nothing of such a class has been near
  /// for 0.5 s.
  std::vector<VoxelIndex> ghosts(const SemanticMap& map, const StateRules& rules, double time) const;

 private:
  struct Seen {
    VoxelIndex index;
    bool hit = false, crossed = false;
  };

  /// What the scene has in a voxel at the time known_at_.
  struct Known {
    simulation::VoxelContent content;
    std::uint8_t bin = 0;       ///< of its distance
    std::optional<bool> close;  ///< whether anything is within one voxel's edge, once that was asked
  };

  Seen& seen(const VoxelIndex& index);
  /// Keeps the answers, since maps of the same scans have the same voxels.
  Known& known(const VoxelIndex& index, double time);
  std::size_t distanceBin(const VoxelIndex& index) const;
  bool isMovable(std::uint32_t raw_label) const;
  bool isGhost(const VoxelIndex& index, double time) const;
  /// The true class of a voxel; kFreeClass if it is empty.
  ClassId classOf(const simulation::VoxelContent& content) const;

  simulation::VoxelTruth truth_;
  GridGeometry geometry_;
  const ClassTable& classes_;
  std::vector<Eigen::Vector3d> origins_;  ///< of all scans
  GridTable index_of_;
  std::vector<Seen> voxels_;
  std::size_t ghosts_ = 0, moments_ = 0;
  double known_at_ = 0.0;  ///< [s]
  GridTable known_index_;
  std::vector<Known> known_;
};

}  // namespace bki_mapping
