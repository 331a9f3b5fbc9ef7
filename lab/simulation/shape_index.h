/// @file Finds the shapes near a place at a time.
#pragma once

#include <vector>

#include "simulation/plane_index.h"
#include "simulation/scene.h"

namespace bki_mapping::simulation {

/// An index of shapes by the places where they are while they are there. Those that never come to rest and
/// never vanish are everywhere.
class ShapeIndex {
 public:
  explicit ShapeIndex(const std::vector<Shape>& shapes);

  /// The numbers of the shapes that may be within a distance of a place, in ascending order; some are not.
  /// @param reach [m].
  std::vector<std::uint32_t> near(const Eigen::Vector2d& at, double reach) const;

 private:
  PlaneIndex index_;
  std::vector<std::uint32_t> everywhere_;
};

/// The shapes within a distance of a place at a time, as they are and move then. They have no legs, so
/// looking at them takes no longer however many they have had.
/// @param index of the shapes. @param reach [m].
std::vector<Shape> shapesNear(const std::vector<Shape>& shapes, const ShapeIndex& index,
                              const Eigen::Vector2d& at, double reach, double time);

}  // namespace bki_mapping::simulation
