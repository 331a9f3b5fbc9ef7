/// @file Storage of 8 x 8 x 8 voxels.
#pragma once

#include <algorithm>
#include <bitset>
#include <cmath>
#include <limits>
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

  /// Takes memory for the planes of further classes, so that adding to these takes none.
  void reserve(std::size_t further_classes) {
    if (further_classes == 0) return;
    classes_.reserve(classes_.size() + further_classes);
    planes_.reserve(planes_.size() + further_classes * kBlockVoxels);  // exactly: doubling would waste planes
  }

  /// Gives back what reserve() took and nobody used, if there is memory to move the planes to.
  void shrink() noexcept {
    if (planes_.capacity() > planes_.size()) planes_.shrink_to_fit();
    if (classes_.capacity() > classes_.size()) classes_.shrink_to_fit();
  }

  /// Adds one value a voxel to the plane of a class, made of zeros where missing. The one way into a plane:
  /// a voxel whose evidence would not be finite afterwards keeps what it has.
  /// @param layers outside of which all values are 0. @return the number of such voxels.
  std::size_t add(ClassId id, const float* values, Layers layers) {
    auto place = static_cast<std::size_t>(std::find(classes_.begin(), classes_.end(), id) - classes_.begin());
    if (place == classes_.size()) {
      reserve(1);
      classes_.push_back(id);
      planes_.resize(planes_.size() + kBlockVoxels, 0.0f);
    }
    float* plane = planes_.data() + place * kBlockVoxels;
    std::uint32_t refused = 0;
    for (int v = layers.begin * kLayer; v < layers.end * kLayer; ++v) {
      const float sum = plane[v] + values[v];
      const bool finite = std::abs(sum) <= std::numeric_limits<float>::max();
      plane[v] = finite ? sum : plane[v];
      refused += finite ? 0u : 1u;
    }
    return refused;
  }
  std::size_t add(ClassId id, const float* values) { return add(id, values, Layers()); }

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
