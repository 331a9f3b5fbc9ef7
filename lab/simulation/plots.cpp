#include "simulation/plots.h"

#include <algorithm>
#include <cmath>

namespace bki_mapping::simulation {
namespace {

/// Whether the axes of one rectangle separate it from another by a gap.
bool separates(const Footprint& a, const Footprint& b, double gap) {
  const double c = std::cos(b.yaw - a.yaw), s = std::sin(b.yaw - a.yaw);
  const Eigen::Rotation2Dd into(-a.yaw);
  const Eigen::Array2d to = (into * (b.centre - a.centre)).array().abs();
  const Eigen::Array2d extent(std::abs(c) * b.half.x() + std::abs(s) * b.half.y(),
                              std::abs(s) * b.half.x() + std::abs(c) * b.half.y());
  return (to > a.half.array() + extent + gap).any();
}

}  // namespace

double Footprint::distanceTo(const Eigen::Vector2d& point) const {
  const Eigen::Array2d to = (Eigen::Rotation2Dd(-yaw) * (point - centre)).array().abs() - half.array();
  return to.max(0.0).matrix().norm();
}

bool Footprint::meets(const Footprint& other, double gap) const {
  return !separates(*this, other, gap) && !separates(other, *this, gap);
}

Plots::Plots(const std::vector<Eigen::Vector3d>& way) : of_way_(8.0), of_places_(16.0) {
  for (const Eigen::Vector3d& point : way) {
    of_way_.add(static_cast<std::uint32_t>(way_.size()), point.head<2>());
    way_.push_back(point.head<2>());
  }
}

bool Plots::isFree(const Footprint& place, double from_way, double gap) const {
  const double radius = place.half.norm();
  bool free = true;
  of_way_.forEachNear(place.centre, radius + from_way, [&](std::uint32_t i) {
    if (free && place.distanceTo(way_[i]) < from_way) free = false;
  });
  if (!free) return false;
  of_places_.forEachNear(place.centre, radius + gap, [&](std::uint32_t i) {
    if (free && place.meets(places_[i], gap)) free = false;
  });
  return free;
}

void Plots::take(const Footprint& place) {
  const Eigen::Vector2d around = Eigen::Vector2d::Constant(place.half.norm());
  of_places_.add(static_cast<std::uint32_t>(places_.size()),
                 Eigen::AlignedBox2d(place.centre - around, place.centre + around));
  places_.push_back(place);
}

}  // namespace bki_mapping::simulation
