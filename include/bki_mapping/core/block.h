/// @file Storage of 8 x 8 x 8 voxels.
#pragma once

#include <algorithm>
#include <bitset>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// Evidence of 512 voxels: one plane of floats for each class that the block has seen. A class without
/// a plane has no evidence there, so its alpha is exactly the prior.
class Block {
 public:
  using Occlusion = std::bitset<kBlockVoxels>;

  /// Classes with a plane, in order of first sight; `kFreeClass` among them.
  const std::vector<ClassId>& classes() const { return classes_; }

  /// The plane of a class: alpha minus the prior, voxel by voxel (GridGeometry::offsetInBlock).
  /// @return nullptr if the block has never seen the class.
  const float* evidence(ClassId id) const {
    const auto found = std::find(classes_.begin(), classes_.end(), id);
    return found == classes_.end() ? nullptr : plane(static_cast<std::size_t>(found - classes_.begin()));
  }
  /// The plane at the given place of classes().
  const float* plane(std::size_t place) const { return planes_.data() + place * kBlockVoxels; }

  /// Some layers of voxels: those from `begin` to before `end`, by their z in the block.
  struct Layers {
    int begin = 0, end = kBlockEdge;
  };

  /// Adds one value a voxel to the plane of a class, made of zeros where missing.
  /// @param layers outside of which all values are 0.
  void add(ClassId id, const float* values, Layers layers) {
    auto place = static_cast<std::size_t>(std::find(classes_.begin(), classes_.end(), id) - classes_.begin());
    if (place == classes_.size()) {
      classes_.push_back(id);
      planes_.reserve(planes_.size() + kBlockVoxels);  // exactly: doubling would waste a plane or two
      planes_.resize(planes_.size() + kBlockVoxels, 0.0f);
    }
    float* plane = planes_.data() + place * kBlockVoxels;
    for (int v = layers.begin * kLayer; v < layers.end * kLayer; ++v) plane[v] += values[v];
  }
  void add(ClassId id, const float* values) { add(id, values, Layers()); }

  /// Fetches the first cache lines of the planes, to be written; processors see to those that follow.
  void prefetch() const {
    constexpr int kFloatsALine = 64 / sizeof(float), kLines = 8;
    for (std::size_t p = 0; p < classes_.size(); ++p) {
      for (int line = 0; line < kLines; ++line) __builtin_prefetch(plane(p) + kFloatsALine * line, 1);
    }
  }

  /// Voxels that the last scan to reach them saw only behind its hits.
  const Occlusion& occlusion() const { return occlusion_; }
  void setOcclusion(const Occlusion& occlusion) { occlusion_ = occlusion; }

  /// True if the block tells nothing: no evidence, no occlusion.
  bool empty() const { return classes_.empty() && occlusion_.none(); }

  /// Bytes held, the object itself included.
  std::size_t bytes() const {
    return sizeof(*this) + planes_.capacity() * sizeof(float) + classes_.capacity() * sizeof(ClassId);
  }

 private:
  static constexpr int kLayer = kBlockEdge * kBlockEdge;

  std::vector<ClassId> classes_;
  std::vector<float> planes_;
  Occlusion occlusion_;
};

}  // namespace bki_mapping
