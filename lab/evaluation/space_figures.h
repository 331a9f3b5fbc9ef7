/// @file The figures of SpaceQuality by name, as evaluate_map writes them.
#pragma once

#include "evaluation/truth_evaluation.h"

namespace bki_mapping {

/// A figure of SpaceQuality, and what it means.
struct SpaceFigure {
  const char* name;
  Proportion SpaceQuality::*proportion;
  const char* meaning;
};
inline constexpr SpaceFigure kSpaceFigures[] = {
    {"free_precision", &SpaceQuality::free_precision, "of the voxels free in the map are mostly empty"},
    {"free_empty", &SpaceQuality::free_empty, "of the same have nothing in them"},
    {"free_recall", &SpaceQuality::free_recall, "of the empty voxels that beams crossed are free in the map"},
    {"occupied_precision", &SpaceQuality::occupied_precision,
     "of the voxels occupied in the map have something in them"},
    {"occupied_near", &SpaceQuality::occupied_near,
     "of the same have something in them or within a voxel's edge"},
    {"occupied_recall", &SpaceQuality::occupied_recall,
     "of the non-empty voxels that were hit are occupied in the map"},
};

}  // namespace bki_mapping
