/// @file One point a cell.
#pragma once

#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// Points with a class each, relative to the sensor.
struct LabelledPoints {
  std::vector<Eigen::Vector3f> points;  ///< relative to the sensor, axes of the map frame [m]
  std::vector<ClassId> labels;          ///< as long as `points`
};

/// Merges the points of each cubic cell of the map frame into their centroid, labelled by the majority
/// (ties: the smaller id). Cells come in the order in which they are first hit.
/// @param origin of the points in the map frame [m]. @param cell edge [m]; 0 returns the input.
LabelledPoints downsample(const Eigen::Vector3d& origin, const LabelledPoints& input, double cell);

}  // namespace bki_mapping
