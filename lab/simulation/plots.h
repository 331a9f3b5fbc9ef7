/// @file Who stands where, seen from above.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "simulation/plane_index.h"

namespace bki_mapping::simulation {

/// A rectangle on the ground.
struct Footprint {
  Eigen::Vector2d centre;  ///< [m]
  Eigen::Vector2d half;    ///< half extents along its own axes [m]
  double yaw = 0.0;        ///< of its x axis [rad]

  double distanceTo(const Eigen::Vector2d& point) const;  ///< 0 inside of it [m]
  /// Whether two come nearer to each other than a gap, or, corner to corner, up to 1.4 times the gap.
  bool meets(const Footprint& other, double gap) const;
};

/// The places that are taken, and the way that must stay free.
class Plots {
 public:
  /// @param way points at most 0.25 m apart [m].
  explicit Plots(const std::vector<Eigen::Vector3d>& way);

  /// Whether a place is free. @param from_way least distance to the way [m]. @param gap least distance to
  /// what stands already [m].
  bool isFree(const Footprint& place, double from_way, double gap) const;
  void take(const Footprint& place);

 private:
  std::vector<Eigen::Vector2d> way_;
  PlaneIndex of_way_, of_places_;
  std::vector<Footprint> places_;
};

}  // namespace bki_mapping::simulation
