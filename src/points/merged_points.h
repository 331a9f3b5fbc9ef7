/// @file Points as they become evidence: after down-sampling, in groups.
#pragma once

#include <cstddef>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// Points and their classes, as one array for each coordinate.
struct MergedPoints {
  std::vector<float> x, y, z;  ///< relative to the sensor, axes of the map frame [m]
  std::vector<ClassId> labels;
  std::vector<float> weights;  ///< by which their kernels are multiplied; empty if all are 1

  std::size_t size() const { return labels.size(); }
  /// Leaves `weights` as they are.
  void resize(std::size_t size) {
    x.resize(size);
    y.resize(size);
    z.resize(size);
    labels.resize(size);
  }
};

/// Points in groups, each of which one thread sorts into blocks; it is quick where a group's points are close
/// together. Either all groups have weights, or none has.
using PointGroups = std::vector<const MergedPoints*>;

inline std::size_t sizeOf(const PointGroups& groups) {
  std::size_t size = 0;
  for (const MergedPoints* group : groups) size += group->size();
  return size;
}

}  // namespace bki_mapping
