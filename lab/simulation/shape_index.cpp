#include "simulation/shape_index.h"

#include <cmath>
#include <iterator>

namespace bki_mapping::simulation {
namespace {

constexpr double kCell = 16.0;  // [m]

/// Calls visit(place) for a shape's centre at its start and at the end of each leg.
template <typename Visit>
void forEachStop(const Shape& shape, Visit&& visit) {
  visit(shape.centre);
  for (const Leg& leg : shape.legs) visit(shape.centreAt(leg.until));
}

/// A shape that is where another one is at a time, and has always had the velocity that it has then.
Shape steadyAt(const Shape& shape, double time) {
  constexpr double kMoment = 1e-3;  // [s]
  Shape steady = shape.standingAt(time);
  steady.velocity = (shape.centreAt(time + kMoment) - shape.centreAt(time)) / kMoment;
  steady.centre -= time * steady.velocity;
  return steady;
}

bool isTurning(const Shape& shape) {
  for (const Leg& leg : shape.legs) {
    if (leg.turn != 0.0) return true;
  }
  return false;
}

}  // namespace

ShapeIndex::ShapeIndex(const std::vector<Shape>& shapes) : index_(kCell) {
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const Shape& shape = shapes[i];
    const auto number = static_cast<std::uint32_t>(i);
    if (!shape.velocity.isZero() && !(shape.period > 0.0)) {
      everywhere_.push_back(number);
      continue;
    }
    // Between two stops, a turn about a hinge leads at most twice the hinge's distance away from the line.
    const double radius = shape.half.head<2>().norm() + (isTurning(shape) ? 2.0 * shape.hinge.norm() : 0.0);
    const Eigen::Vector2d around = Eigen::Vector2d::Constant(radius);
    Eigen::Vector2d before = shape.centre.head<2>();
    forEachStop(shape, [&](const Eigen::Vector3d& centre) {
      const Eigen::Vector2d here = centre.head<2>();
      index_.add(number, Eigen::AlignedBox2d(before.cwiseMin(here) - around, before.cwiseMax(here) + around));
      before = here;
    });
  }
}

std::vector<std::uint32_t> ShapeIndex::near(const Eigen::Vector2d& at, double reach) const {
  const std::vector<std::uint32_t> here = index_.near(at, reach);
  if (everywhere_.empty()) return here;
  std::vector<std::uint32_t> all;
  all.reserve(here.size() + everywhere_.size());
  std::merge(here.begin(), here.end(), everywhere_.begin(), everywhere_.end(), std::back_inserter(all));
  return all;
}

std::vector<Shape> shapesNear(const std::vector<Shape>& shapes, const ShapeIndex& index,
                              const Eigen::Vector2d& at, double reach, double time) {
  std::vector<Shape> near;
  for (const std::uint32_t number : index.near(at, reach)) {
    const Shape& shape = shapes[number];
    if (!shape.isThereAt(time)) continue;
    const double radius = reach + shape.half.head<2>().norm();
    if ((shape.centreAt(time).head<2>() - at).squaredNorm() < radius * radius)
      near.push_back(steadyAt(shape, time));
  }
  return near;
}

}  // namespace bki_mapping::simulation
