/// @file The same scans in an OctoMap, for comparison.
#pragma once

#include <memory>

#include "bki_mapping/core/scan.h"
#include "evaluation/occupants.h"

namespace bki_mapping {

/// An OctoMap of Debian's library, with the library's defaults, which are octomap_server's: probabilities 0.7
/// of a hit and 0.4 of a miss, clamped to 0.12 and 0.97, without a largest range. Its voxels are those of a
/// map with the same resolution.
class OctomapMapper : public Occupants {
 public:
  /// @param resolution of the voxels [m].
  explicit OctomapMapper(double resolution);
  ~OctomapMapper() override;

  /// Adds all finite points of a scan, whatever their labels. @return time that took [ms].
  double integrate(const Scan& scan);
  std::optional<ClassId> at(const VoxelIndex& voxel) override;
  std::size_t bytes() const;  ///< of memory

 private:
  struct Tree;
  std::unique_ptr<Tree> tree_;
};

}  // namespace bki_mapping
