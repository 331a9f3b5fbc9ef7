/// @file How well a map keeps what stands and forgets what moved.
#pragma once

#include <cmath>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/map/semantic_map.h"

namespace bki_mapping {

/// The accuracies of the DynamicMap benchmark (Zhang et al., ITSC 2023), point by point of the input.
struct DynamicsQuality {
  std::size_t static_points = 0;  ///< labelled points of things that stand, of all scans
  std::size_t static_kept = 0;    ///< of these, in voxels that the map calls occupied
  /// Of the static points, and of those kept: by class flags ground, dynamic (what could move, but stands),
  /// and neither.
  std::size_t ground_points = 0, ground_kept = 0, standing_points = 0, standing_kept = 0, other_points = 0,
              other_kept = 0;
  std::size_t floor_voxels = 0;    ///< voxels that hold static points of ground
  std::size_t floor_holes = 0;     ///< of these, such that the map does not call occupied
  std::size_t moving_points = 0;   ///< points of things that move, of the first half of the scans, in voxels
                                   ///< that no point of the last scans hits
  std::size_t moving_removed = 0;  ///< of these, in voxels that the map does not call occupied

  double staticAccuracy() const { return share(static_kept, static_points); }  ///< SA
  double groundAccuracy() const { return share(ground_kept, ground_points); }
  double standingAccuracy() const { return share(standing_kept, standing_points); }
  double otherAccuracy() const { return share(other_kept, other_points); }
  double holes() const { return share(floor_holes, floor_voxels); }
  double dynamicAccuracy() const { return share(moving_removed, moving_points); }      ///< DA
  double accuracy() const { return std::sqrt(staticAccuracy() * dynamicAccuracy()); }  ///< AA
  double harmonicAccuracy() const {                                                    ///< HA
    const double sum = staticAccuracy() + dynamicAccuracy();
    return sum == 0.0 ? 0.0 : 2.0 * staticAccuracy() * dynamicAccuracy() / sum;
  }

 private:
  /// NaN if there is nothing to share.
  static double share(std::size_t part, std::size_t whole) {
    return static_cast<double>(part) / static_cast<double>(whole);
  }
};

/// What became of a voxel: things in it stand, or moved.
enum class VoxelFate {
  kKept,       ///< they stand, and it is occupied
  kLost,       ///< they stand, and it is not
  kForgotten,  ///< they moved, and it is not occupied
  kLeft,       ///< they moved, and it still is
};

/// Collects the labelled points of a drive, voxel by voxel, and compares a map with them.
class DynamicsEvaluation {
 public:
  /// Raw labels of moving things in SemanticKITTI, 252 to 259.
  static std::set<std::uint32_t> movingOfSemanticKitti();

  /// @param scans how many will be added. @param late number of last scans whose hits excuse a voxel.
  DynamicsEvaluation(const GridGeometry& geometry, std::set<std::uint32_t> moving, std::size_t scans,
                     std::size_t late)
      : geometry_(geometry), moving_(std::move(moving)), scans_(scans), late_(late) {}

  /// Adds the next scan. Points that are not finite, or whose class is none or the unlabelled one, do not
  /// count. Ids of the class table do not tell what moves: points so labelled all count as standing.
  void add(const Scan& scan, const ClassTable& classes);

  DynamicsQuality compare(const SemanticMap& map) const;
  /// Voxel by voxel; those that only late or unlabelled points are in are left out.
  std::vector<std::pair<VoxelIndex, VoxelFate>> fates(const SemanticMap& map) const;

 private:
  struct Voxel {
    VoxelIndex index;
    std::uint32_t ground_points = 0, standing_points = 0, other_points = 0, early_moving_points = 0;
    bool hit_late = false;
  };

  GridGeometry geometry_;
  std::set<std::uint32_t> moving_;
  std::size_t scans_, late_, added_ = 0;
  GridTable number_;
  std::vector<Voxel> voxels_;
};

}  // namespace bki_mapping
