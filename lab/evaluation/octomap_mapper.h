/// @file The same scans in an OctoMap, for comparison.
#pragma once

#include <memory>

#include "bki_mapping/core/scan.h"
#include "evaluation/occupants.h"
#include "evaluation/octomap_settings.h"
#include "evaluation/scan_timer.h"

namespace bki_mapping {

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
