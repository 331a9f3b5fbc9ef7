/// @file Colours of voxels by state and class; ros/publishers/cell_markers.cpp has the other ways to colour
/// them.
#pragma once

#include <array>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/rules/voxel_state.h"

namespace bki_mapping {

using Color = std::array<std::uint8_t, 3>;  ///< red, green, blue

constexpr Color kFreeColor = {200, 225, 240};
constexpr Color kOccludedColor = {60, 60, 70};

/// The colour of the class for an occupied voxel; kFreeColor or kOccludedColor for others.
inline Color semanticColor(VoxelState state, ClassId label, const ClassTable& classes) {
  if (state == VoxelState::kFree) return kFreeColor;
  const SemanticClass* known = classes.find(label);
  return known ? known->color : kOccludedColor;
}

/// The same classes in colours that people can tell apart. The colours of data sets are made for labels in
/// images: unlabelled is black, which stands out in a map, and some classes have nearly the same colour. Here
/// unlabelled is grey, and of classes with nearly the same colour all but the first take another one.
ClassTable displayTable(const ClassTable& classes);

}  // namespace bki_mapping
