/// @file The evidence of 8 x 8 x 8 voxels.
#pragma once

#include <algorithm>
#include <bitset>
#include <cmath>
#include <limits>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// The evidence of 512 voxels: one plane of floats for each class that the block has seen. A class without a
/// plane has no evidence in the block: its concentrations equal the prior.
class Block {
 public:
  using Occlusion = std::bitset<kBlockVoxels>;

  /// The classes with a plane, in the order in which they were first seen; may include kFreeClass.
  const std::vector<ClassId>& classes() const { return classes_; }

  /// The plane of a class: the evidence at each voxel, by GridGeometry::offsetInBlock.
  /// @return nullptr if the block has no plane for the class.
  const float* evidence(ClassId id) const {
    const auto found = std::find(classes_.begin(), classes_.end(), id);
    return found == classes_.end() ? nullptr : plane(static_cast<std::size_t>(found - classes_.begin()));
  }
  /// The plane of the class at a position in classes().
  const float* plane(std::size_t position) const { return planes_.data() + position * kBlockVoxels; }

  /// A range of layers of voxels along z: `begin` to `end` - 1.
  struct Layers {
    int begin = 0, end = kBlockEdge;
  };

  /// Allocates memory for the planes of further classes, so that adding to them does not.
  void reserve(std::size_t further_classes) {
    if (further_classes == 0) return;
    classes_.reserve(classes_.size() + further_classes);
    planes_.reserve(planes_.size() + further_classes * kBlockVoxels);  // exactly: doubling would waste planes
  }

  /// Returns unused memory that reserve() took, unless memory is too short to move the planes.
  void shrink() noexcept {
    if (planes_.capacity() > planes_.size()) planes_.shrink_to_fit();
    if (classes_.capacity() > classes_.size()) classes_.shrink_to_fit();
  }

  /// Adds one value for each voxel to the plane of a class, which is created if missing. Every change to a
  /// plane goes through here, so that evidence stays finite: a voxel whose sum is not finite keeps its value.
  /// @param values 512 of them. @param layers those that may hold values other than 0.
  /// @return the number of voxels that kept their value.
  std::size_t add(ClassId id, const float* values, Layers layers) {
    const auto found = std::find(classes_.begin(), classes_.end(), id);
    const auto position = static_cast<std::size_t>(found - classes_.begin());
    if (position == classes_.size()) {
      reserve(1);
      classes_.push_back(id);
      planes_.resize(planes_.size() + kBlockVoxels, 0.0f);
    }
    float* plane = planes_.data() + position * kBlockVoxels;
    std::uint32_t refused = 0;
    for (int v = layers.begin * kLayerVoxels; v < layers.end * kLayerVoxels; ++v) {
      const float sum = plane[v] + values[v];
      const bool finite = std::abs(sum) <= std::numeric_limits<float>::max();
      plane[v] = finite ? sum : plane[v];
      refused += finite ? 0u : 1u;
    }
    return refused;
  }
  std::size_t add(ClassId id, const float* values) { return add(id, values, Layers()); }

  /// Prefetches the first cache lines of the planes for writing; the hardware prefetcher then follows.
  void prefetch() const {
    constexpr int kFloatsPerLine = 64 / sizeof(float), kLines = 8;
    for (std::size_t p = 0; p < classes_.size(); ++p) {
      for (int line = 0; line < kLines; ++line) __builtin_prefetch(plane(p) + kFloatsPerLine * line, 1);
    }
  }

  /// The voxels that the last scan to reach them saw only beyond the ends of its beams.
  const Occlusion& occlusion() const { return occlusion_; }
  void setOcclusion(const Occlusion& occlusion) { occlusion_ = occlusion; }

  /// Whether the block holds no evidence and no occlusion marks.
  bool empty() const { return classes_.empty() && occlusion_.none(); }

  /// Memory of the block, including this object [bytes].
  std::size_t bytes() const {
    return sizeof(*this) + planes_.capacity() * sizeof(float) + classes_.capacity() * sizeof(ClassId);
  }

 private:
  static constexpr int kLayerVoxels = kBlockEdge * kBlockEdge;

  std::vector<ClassId> classes_;
  std::vector<float> planes_;
  Occlusion occlusion_;
};

}  // namespace bki_mapping
