/// @file The sums that evidence adds to one block.
#pragma once

#include <vector>

#include "bki_mapping/map/block.h"
#include "map/voxel_mask.h"

namespace bki_mapping {

/// Sums of k, or of w k, over the points or beams of a scan, as one plane for each class. Keeps its memory
/// when cleared.
class BlockSums {
 public:
  struct Plane {
    alignas(64) float values[kBlockVoxels];
    Block::Layers layers;  ///< those that may hold values other than 0
    ClassId label;
  };

  void clear() {
    size_ = 0;
    occupied.reset();
  }
  /// Allocates memory for this many classes.
  void reserve(std::size_t classes) {
    if (planes_.size() < classes) planes_.resize(classes);
  }
  /// Adds the plane of a class that has none. The caller sets all 512 values.
  Plane& open(ClassId label) {
    Plane& plane = planes_[size_++];
    plane.layers = Block::Layers();
    plane.label = label;
    return plane;
  }
  /// Removes the plane opened last.
  void drop() { --size_; }

  Plane* begin() { return planes_.data(); }
  Plane* end() { return planes_.data() + size_; }
  const Plane* begin() const { return planes_.data(); }
  const Plane* end() const { return planes_.data() + size_; }

  VoxelMask occupied;  ///< voxels that contain a hit, if the evidence reports them

 private:
  std::vector<Plane> planes_;
  std::size_t size_ = 0;
};

}  // namespace bki_mapping
