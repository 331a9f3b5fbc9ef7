/// @file The evidence of 8 x 8 x 8 voxels.
#pragma once

#include <algorithm>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bki_mapping/core/types.h"
#include "bki_mapping/map/class_list.h"
#include "bki_mapping/map/evidence_rounding.h"
#include "bki_mapping/map/looks.h"

namespace bki_mapping {

/// What std::make_shared adds to an object [bytes].
constexpr std::size_t kReferenceCountBytes = 2 * sizeof(void*);

/// The evidence of 512 voxels: one plane for each class of which a voxel has evidence. A class without a
/// plane has no evidence in the block: its concentrations equal the prior. Equal evidence means equal blocks,
/// however it came together.
class Block {
 public:
  using Occlusion = std::bitset<kBlockVoxels>;

  Block() = default;
  /// A copy with memory for the planes of further classes.
  Block(const Block& other, std::size_t further_classes)
      : looks_(other.looks_), occlusion_(other.occlusion_) {
    reserve(other.classes_.size() + further_classes);
    classes_ = other.classes_;
    planes_.assign(other.planes_.begin(), other.planes_.end());
  }

  /// The classes with a plane, by rising id; may include kFreeClass.
  const ClassList& classes() const { return classes_; }

  /// The plane of a class: the evidence at each voxel, by GridGeometry::offsetInBlock.
  /// @return nullptr if the block has no plane for the class.
  const EvidenceUnits* evidence(ClassId id) const {
    const std::size_t position = classes_.positionOf(id);
    return classes_.has(id, position) ? plane(position) : nullptr;
  }
  /// The plane of the class at a position in classes().
  const EvidenceUnits* plane(std::size_t position) const { return planes_.data() + position * kBlockVoxels; }

  /// A range of layers of voxels along z: `begin` to `end` - 1.
  struct Layers {
    int begin = 0, end = kBlockEdge;
  };

  /// Allocates memory for the planes of further classes, so that changing them does not.
  void reserve(std::size_t further_classes) {
    if (further_classes == 0) return;
    classes_.reserve(classes_.size() + further_classes);
    planes_.reserve(planes_.size() + further_classes * kBlockVoxels);  // exactly: doubling would waste planes
  }

  /// The number of classes of which another block has a plane, and this one has not.
  std::size_t newClassesOf(const Block& other) const {
    return static_cast<std::size_t>(std::count_if(other.classes_.begin(), other.classes_.end(),
                                                  [&](ClassId id) { return !evidence(id); }));
  }

  /// Returns unused memory that reserve() allocated, unless too little memory is left to move the planes.
  void shrink() noexcept {
    if (planes_.capacity() > planes_.size()) planes_.shrink_to_fit();
    classes_.shrink();
    looks_.shrink();
  }

  /// Changes the plane of a class, which is created if missing, and removed if nothing is left in it.
  /// @param change called as change(plane); returns false if it left nothing where it wrote.
  template <typename Change>
  void change(ClassId id, Change&& change) {
    const std::size_t position = classes_.positionOf(id), begin = position * kBlockVoxels;
    const auto at = [](auto& vector, std::size_t n) {
      return vector.begin() + static_cast<std::ptrdiff_t>(n);
    };
    if (!classes_.has(id, position)) {
      reserve(1);
      classes_.insert(position, id);
      planes_.insert(at(planes_, begin), kBlockVoxels, 0);
    }
    if (change(planes_.data() + begin)) return;
    const auto first = at(planes_, begin), last = first + kBlockVoxels;
    if (std::any_of(first, last, [](EvidenceUnits units) { return units != 0; })) return;
    classes_.erase(position);
    planes_.erase(first, last);
  }

  /// Adds a plane of another block. @return the number of voxels whose evidence has saturated.
  std::size_t add(ClassId id, const EvidenceUnits* units) {
    std::size_t saturated = 0;
    change(id, [&](EvidenceUnits* plane) {
      EvidenceUnits any = 0;
      for (int v = 0; v < kBlockVoxels; ++v) {
        const std::int64_t sum = std::int64_t{plane[v]} + units[v], most = kMostUnits;
        plane[v] = static_cast<EvidenceUnits>(std::clamp(sum, -most, most));
        saturated += plane[v] != sum;
        any |= plane[v];
      }
      return any != 0;
    });
    return saturated;
  }

  /// Prefetches the first cache lines of the planes; the hardware prefetcher then follows.
  template <bool kForWriting = true>
  void prefetch() const {
    constexpr int kUnitsPerLine = 64 / sizeof(EvidenceUnits), kLines = 8;
    for (std::size_t p = 0; p < classes_.size(); ++p) {
      for (int line = 0; line < kLines; ++line) {
        __builtin_prefetch(plane(p) + kUnitsPerLine * line, kForWriting ? 1 : 0);
      }
    }
  }

  /// Prefetches the block itself, without its planes and looks.
  void prefetchHead() const {
    __builtin_prefetch(this);
    __builtin_prefetch(&looks_);
  }

  /// The voxels that the last scan to reach them saw only beyond the ends of its beams.
  const Occlusion& occlusion() const { return occlusion_; }
  void setOcclusion(const Occlusion& occlusion) { occlusion_ = occlusion; }

  /// When scans looked at the voxels. They say nothing of voxels without evidence.
  const Looks& looks() const { return looks_; }
  Looks& looks() { return looks_; }

  /// Whether the block holds no evidence and no occlusion marks.
  bool empty() const { return classes_.empty() && occlusion_.none(); }

  /// Memory of the block, including this object and its reference count [bytes].
  std::size_t bytes() const {
    return sizeof(*this) + kReferenceCountBytes + planes_.capacity() * sizeof(EvidenceUnits) +
           classes_.bytes() + looks_.bytes();
  }

 private:
  // What a scan reads of most blocks comes first, in one or two cache lines.
  ClassList classes_;
  std::vector<EvidenceUnits> planes_;
  Looks looks_;
  Occlusion occlusion_;
};

}  // namespace bki_mapping
