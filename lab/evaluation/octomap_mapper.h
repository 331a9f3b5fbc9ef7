/// @file The same scans in an OctoMap, for comparison.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/core/scan.h"
#include "evaluation/occupants.h"
#include "evaluation/scan_timer.h"

namespace bki_mapping {

/// How OctoMap takes scans, by the names of octomap_server's parameters where it has them. The defaults are
/// those of octomap_server.
struct OctomapSettings {
  double max_range = -1.0;  ///< beyond it, beams only clear, up to it [m]; -1: no limit
  double hit = 0.7;         ///< probability of occupancy that a hit stands for, above 0.5
  double miss = 0.4;        ///< the same of a beam that passes, below 0.5
  double min = 0.12;        ///< probabilities are clamped to min and max
  double max = 0.97;
  double threshold = 0.5;    ///< voxels of at least this probability are occupied
  bool discretize = false;   ///< one beam to each voxel that is hit
  bool rays = false;         ///< each beam counts for itself: insertPointCloudRays
  bool lazy = false;         ///< inner nodes, which serve coarser queries, are not kept up to date
  bool compress_map = true;  ///< the tree is pruned after each scan
};

/// @param text "default", or NAME=VALUE,... @throws std::invalid_argument that names all wrong settings.
OctomapSettings octomapSettings(const std::string& text);

/// An OctoMap of Debian's library, which is compiled for one thread. It takes scans as octomap_server does,
/// and its voxels are those of a map with the same resolution.
class OctomapMapper : public Occupants {
 public:
  /// @param resolution of the voxels [m].
  explicit OctomapMapper(double resolution, const OctomapSettings& settings = {});
  ~OctomapMapper() override;

  /// Adds all finite points of a scan, whatever their labels. @return how long that took.
  ScanTime integrate(const Scan& scan);
  std::optional<ClassId> at(const VoxelIndex& voxel) override;
  Occupant occupantOf(const VoxelIndex& voxel) const override;
  void forEachKnown(const Visit& visit) const override;
  std::size_t bytes() const;  ///< of memory, as OctoMap counts its nodes

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace bki_mapping
