/// @file Measures how well a map keeps static objects and clears moving ones.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/core/scan.h"
#include "evaluation/occupants.h"
#include "evaluation/passing_beams.h"
#include "simulation/truth_cloud.h"

namespace bki_mapping {

/// The accuracies of the DynamicMap benchmark (Zhang et al., ITSC 2023), of counted points.
struct Accuracies {
  std::size_t static_points = 0;   ///< points of static objects
  std::size_t static_kept = 0;     ///< of these, those that the map keeps
  std::size_t moving_points = 0;   ///< points of moving objects
  std::size_t moving_removed = 0;  ///< of these, those that the map does not keep

  double staticAccuracy() const { return fraction(static_kept, static_points); }       ///< SA
  double dynamicAccuracy() const { return fraction(moving_removed, moving_points); }   ///< DA
  double accuracy() const { return std::sqrt(staticAccuracy() * dynamicAccuracy()); }  ///< AA
  double harmonicAccuracy() const {                                                    ///< HA
    const double sum = staticAccuracy() + dynamicAccuracy();
    return sum == 0.0 ? 0.0 : 2.0 * staticAccuracy() * dynamicAccuracy() / sum;
  }

 protected:
  /// NaN of nothing.
  static double fraction(std::size_t part, std::size_t all) {
    return static_cast<double>(part) / static_cast<double>(all);
  }
};

/// Static points, and those of them that the map keeps.
struct KeptPoints {
  std::size_t points = 0, kept = 0;
  double accuracy() const { return static_cast<double>(kept) / static_cast<double>(points); }  ///< SA
};

/// The accuracies of a map, counted over the labelled points of the scans: static ones of all scans, and
/// moving ones of the first half, in voxels that no point of the last scans hits and that are not taken. The
/// map keeps a point if its voxel is occupied.
struct DynamicsQuality : Accuracies {
  /// Static points, and those of them kept, by class flag: ground, dynamic (could move, but stands still),
  /// and neither.
  std::size_t ground_points = 0, ground_kept = 0, standing_points = 0, standing_kept = 0, other_points = 0,
              other_kept = 0;
  /// The same by the lower 16 bits of the labels, which also differ where the class table has one class for
  /// all.
  std::map<std::uint32_t, KeptPoints> by_label;
  std::size_t floor_voxels = 0;  ///< voxels with static points of ground
  std::size_t floor_holes = 0;   ///< of these, those that are not occupied
  /// Of the holes, those above and below which no voxel is occupied, either.
  std::size_t floor_open_holes = 0;
  /// Moving points that no map can tell to be gone: those in voxels shared with static points, and those in
  /// other voxels that no beam came near after the last moving point.
  std::size_t moving_shared = 0, moving_unseen = 0;
  std::size_t decidable_points = 0;   ///< the other moving points
  std::size_t decidable_removed = 0;  ///< of these, those that the map does not keep
  /// Of the decidable points, those in voxels that a beam entered after the last moving point: it passed
  /// within half an edge of the centre. And those of them that the map does not keep.
  std::size_t entered_points = 0, entered_removed = 0;

  double groundAccuracy() const { return fraction(ground_kept, ground_points); }
  double standingAccuracy() const { return fraction(standing_kept, standing_points); }
  double otherAccuracy() const { return fraction(other_kept, other_points); }
  double holes() const { return fraction(floor_holes, floor_voxels); }
  double openHoles() const { return fraction(floor_open_holes, floor_voxels); }
  double decidableAccuracy() const { return fraction(decidable_removed, decidable_points); }
  double enteredAccuracy() const { return fraction(entered_removed, entered_points); }
};

/// The outcome for a voxel, by its points: of static or of moving objects.
enum class VoxelFate {
  kKept,       ///< static, and occupied
  kLost,       ///< static, but not occupied
  kForgotten,  ///< moved, and not occupied
  kLeft,       ///< moved, but still occupied
};

/// Collects the labelled points of a drive, voxel by voxel, and compares a map with them.
class DynamicsEvaluation {
 public:
  /// Whether a voxel contains an object that can move at the end of the drive, if the truth is known. The map
  /// need not clear such a voxel.
  using Taken = std::function<bool(const VoxelIndex&)>;

  /// @param scans number of scans that will be added. @param late voxels hit in this many last scans need not
  /// be cleared.
  DynamicsEvaluation(const GridGeometry& geometry, KittiLabels moving, std::size_t scans, std::size_t late)
      : geometry_(geometry), moving_(std::move(moving)), scans_(scans), late_(late) {}

  /// Adds the next scan. Skips points that are not finite, unlabelled, or have a label outside of the class
  /// table. Ids of the class table do not say what moves: points labelled by id all count as static.
  void add(const Scan& scan, const ClassTable& classes) { add(scan, classes, scan); }
  /// The same of a scan that lacks points. @param whole the scan with all of its beams, whatever their
  /// labels.
  void add(const Scan& scan, const ClassTable& classes, const Scan& whole);
  /// Says that no more scans will be added, although fewer were than announced.
  void end() { scans_ = added_; }

  /// Whether what moved through a voxel has left it: no point of the last scans hits the voxel, and it is not
  /// taken. @param taken may be empty.
  bool hasBeenLeft(const VoxelIndex& index, const Taken& taken = {}) const;
  /// Whether something that can move is in a voxel at the end of the drive: the voxel is taken; if the truth
  /// is not known, a moving point of the last scan is in it. Where beams are too far apart to hit the voxel,
  /// neither this nor hasBeenLeft() needs to be true. @param taken may be empty.
  bool isStillThere(const VoxelIndex& index, const Taken& taken = {}) const;
  /// @param taken may be empty.
  DynamicsQuality compare(Occupants& map, const Taken& taken = {}) const;
  DynamicsQuality compare(const SemanticMap& map, const StateRules& rules, const Taken& taken = {}) const {
    MapOccupants occupants(map, rules);
    return compare(occupants, taken);
  }
  /// The outcome for each voxel that has points of static or of early moving objects.
  std::vector<std::pair<VoxelIndex, VoxelFate>> fates(Occupants& map, const Taken& taken = {}) const;
  std::vector<std::pair<VoxelIndex, VoxelFate>> fates(const SemanticMap& map, const StateRules& rules,
                                                      const Taken& taken = {}) const {
    MapOccupants occupants(map, rules);
    return fates(occupants, taken);
  }

 private:
  static constexpr std::uint32_t kNone = 0xffffffff;

  struct Voxel {
    VoxelIndex index;
    std::uint32_t ground_points = 0, standing_points = 0, other_points = 0;
    std::size_t last_hit = 0;      ///< the last scan with a point
    std::size_t last_moved = 0;    ///< the last scan with a moving point, if moved
    std::uint32_t labels = kNone;  ///< position of the first in labels_
    bool moved = false;
    bool seen_again = false;     ///< a beam has passed within a voxel's edge of the centre since last_moved
    bool entered_again = false;  ///< within half an edge

    bool isShared() const { return ground_points + standing_points + other_points > 0; }
  };

  /// Static points of one label in a voxel; a list, because few voxels have more than one.
  struct LabelPoints {
    std::uint32_t label, points, next;
  };

  struct MovingPoint {
    std::uint32_t voxel;  ///< position in voxels_
    std::size_t scan;
  };

  void countLabel(Voxel& voxel, std::uint32_t label);
  /// The number of moving points in the first half of the scans, for each voxel.
  std::vector<std::uint32_t> earlyMovingPoints() const;
  /// Notes the voxels that something moving has left and that beams of the scan come near or enter.
  void findEntered(const Scan& scan);

  bool mayBeOccupied(const Voxel& voxel, const Taken& taken) const {
    return voxel.last_hit + late_ >= scans_ || (taken && taken(voxel.index));
  }

  GridGeometry geometry_;
  KittiLabels moving_;
  std::size_t scans_, late_, added_ = 0;
  GridTable index_of_;
  std::vector<Voxel> voxels_;
  std::vector<LabelPoints> labels_;
  std::vector<MovingPoint> moving_points_;
  std::vector<std::uint32_t> not_entered_;  ///< voxels with moving points that no beam has entered since
  PassingBeams beams_;                      ///< of the last scan
};

}  // namespace bki_mapping
