#include "simulation/scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace bki_mapping::simulation {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Rotates a vector about the vertical by -yaw: from the world's axes to those of a box.
Eigen::Vector3d intoAxes(const Eigen::Vector3d& v, double yaw) {
  const double c = std::cos(yaw), s = std::sin(yaw);
  return {c * v.x() + s * v.y(), -s * v.x() + c * v.y(), v.z()};
}

/// Clips the interval [enter, leave] of a ray to a slab |coordinate| <= half.
void clipToSlab(double origin, double direction, double half, double& enter, double& leave) {
  if (direction == 0.0) {
    if (std::abs(origin) > half) leave = -kInfinity;
    return;
  }
  const double a = (-half - origin) / direction, b = (half - origin) / direction;
  enter = std::max(enter, std::min(a, b));
  leave = std::min(leave, std::max(a, b));
}

/// Clips the interval [enter, leave] of a ray to where a t^2 + 2 b t + c < 0.
void clipToQuadric(double a, double b, double c, double& enter, double& leave) {
  const double discriminant = b * b - a * c;
  if (a <= 0.0) {
    if (c > 0.0) leave = -kInfinity;  // a vertical ray beside a cylinder
    return;
  }
  if (discriminant < 0.0) {
    leave = -kInfinity;
    return;
  }
  enter = std::max(enter, (-b - std::sqrt(discriminant)) / a);
  leave = std::min(leave, (-b + std::sqrt(discriminant)) / a);
}

}  // namespace

Shape::Placement Shape::placeAt(double time) const {
  if (period > 0.0) time -= period * std::floor(time / period);
  Eigen::Vector3d at = centre;
  double begin = 0.0, turned = 0.0;
  bool ends = true;
  for (const Leg& leg : legs) {
    ends = time > leg.until;
    const double duration = (ends ? leg.until : time) - begin;
    at += duration * leg.velocity;
    turned += duration * leg.turn;
    begin = leg.until;
    if (!ends) break;
  }
  if (ends) at += (time - begin) * velocity;
  if (turned != 0.0) at.head<2>() += hinge - Eigen::Rotation2Dd(turned) * hinge;
  return {at, yaw + turned};
}

Shape Shape::standingAt(double time) const {
  const Placement place = placeAt(time);
  Shape standing{type, place.centre, half, place.yaw};
  standing.label = label;
  return standing;
}

bool Shape::contains(const Eigen::Vector3d& point, double time) const {
  if (!isThereAt(time)) return false;
  const Placement place = placeAt(time);
  const Eigen::Array3d r = intoAxes(point - place.centre, place.yaw).cwiseQuotient(half).array();
  switch (type) {
    case ShapeType::kBox:
      return (r.abs() <= 1.0).all();
    case ShapeType::kCylinder:
      return r.x() * r.x() + r.y() * r.y() <= 1.0 && std::abs(r.z()) <= 1.0;
    case ShapeType::kEllipsoid:
      return r.square().sum() <= 1.0;
  }
  return false;
}

std::optional<double> Shape::hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                 double time) const {
  if (!isThereAt(time)) return std::nullopt;
  // In coordinates where the shape has half extents 1.
  const Placement place = placeAt(time);
  const Eigen::Vector3d o = intoAxes(origin - place.centre, place.yaw).cwiseQuotient(half);
  const Eigen::Vector3d d = intoAxes(direction, place.yaw).cwiseQuotient(half);
  double enter = 0.0, leave = kInfinity;
  switch (type) {
    case ShapeType::kBox:
      for (int axis = 0; axis < 3; ++axis) clipToSlab(o[axis], d[axis], 1.0, enter, leave);
      break;
    case ShapeType::kCylinder:
      clipToSlab(o.z(), d.z(), 1.0, enter, leave);
      clipToQuadric(d.head<2>().squaredNorm(), o.head<2>().dot(d.head<2>()), o.head<2>().squaredNorm() - 1.0,
                    enter, leave);
      break;
    case ShapeType::kEllipsoid:
      clipToQuadric(d.squaredNorm(), o.dot(d), o.squaredNorm() - 1.0, enter, leave);
      break;
  }
  if (enter > leave || enter <= 0.0) return std::nullopt;
  return enter;
}

std::uint32_t Ground::labelAt(double x, double y) const {
  const auto toAxis = [&](double c) {
    return std::abs(c - street_distance * std::clamp(std::round(c / street_distance), 0.0, streets - 1.0));
  };
  const double distance =
      relief ? relief->fromAxis(x, y) : (streets == 0 ? std::abs(y) : std::min(toAxis(x), toAxis(y)));
  return distance < road_half_width ? road : (distance < sidewalk_half_width ? sidewalk : terrain);
}

std::optional<double> Ground::hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                  double max_range) const {
  if (relief) return relief->hit(origin, direction, max_range);
  if (!(direction.z() < 0.0 && -origin.z() / direction.z() < max_range)) return std::nullopt;
  return -origin.z() / direction.z();
}

std::optional<std::uint32_t> Scene::shapeLabelAt(const Eigen::Vector3d& point, double time) const {
  for (const Shape& shape : shapes) {
    if (shape.contains(point, time)) return shape.label;
  }
  return std::nullopt;
}

std::optional<std::uint32_t> Scene::labelAt(const Eigen::Vector3d& point, double time) const {
  const auto of_shape = shapeLabelAt(point, time);
  if (of_shape || point.z() > ground.heightAt(point.x(), point.y())) return of_shape;
  return ground.labelAt(point.x(), point.y());
}

}  // namespace bki_mapping::simulation
