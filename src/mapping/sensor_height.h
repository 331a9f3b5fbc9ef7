/// @file The height of the sensor above the ground, as a scan shows it.
#pragma once

#include <vector>

#include "bki_mapping/core/class_table.h"
#include "points/merged_points.h"

namespace bki_mapping {

/// Finds the height of the sensor in scan after scan; keeps its memory from one to the next.
class SensorHeight {
 public:
  explicit SensorHeight(const ClassTable& classes);

  /// The median height of the sensor above the hits of classes flagged ground within 10 m of it in the plane,
  /// or within 20 m if there are fewer than 20 within 10 m [m]. It depends on the set of the hits alone. 0 if
  /// there are fewer than 20, or the ground is not below the sensor. The map frame's z axis points up.
  double in(const PointGroups& hits);

 private:
  ClassSet ground_;
  std::vector<float> near_, far_;
};

}  // namespace bki_mapping
