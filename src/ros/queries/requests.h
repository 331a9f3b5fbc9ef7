/// @file Common parts of the requests: batches, points and sets of classes.
#pragma once

#include <geometry_msgs/Point.h>
#include <geometry_msgs/Vector3.h>

#include <Eigen/Core>
#include <stdexcept>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping::ros_interface {

template <typename Message>
Eigen::Vector3d toVector(const Message& xyz) {
  return {xyz.x, xyz.y, xyz.z};
}

inline std::vector<Eigen::Vector3d> toVectors(const std::vector<geometry_msgs::Point>& points) {
  std::vector<Eigen::Vector3d> vectors;
  vectors.reserve(points.size());
  for (const geometry_msgs::Point& point : points) vectors.push_back(toVector(point));
  return vectors;
}

template <typename Message = geometry_msgs::Point>
Message fromVector(const Eigen::Vector3d& vector) {
  Message xyz;
  xyz.x = vector.x();
  xyz.y = vector.y();
  xyz.z = vector.z();
  return xyz;
}

/// @param what a batch consists of, such as "points". @throws std::invalid_argument if it has too many.
inline void checkBatch(std::size_t count, std::size_t most, const char* what) {
  if (count <= most) return;
  throw std::invalid_argument("the call has " + std::to_string(count) + " " + what + "; split it, " +
                              std::to_string(most) + " are the most");
}

/// @param values one for each of `count` things, or one for all. @param field their name in the request.
/// @throws std::invalid_argument if there are neither.
template <typename Values>
void checkCount(const Values& values, std::size_t count, const std::string& field) {
  if (values.size() == count || values.size() == 1) return;
  throw std::invalid_argument(field + " has " + std::to_string(values.size()) + " entries for a batch of " +
                              std::to_string(count) + "; give one for each, or one for all");
}

/// The value of the n-th thing. @param values checked by checkCount.
template <typename Values>
const auto& valueFor(const Values& values, std::size_t n) {
  return values.size() == 1 ? values.front() : values[n];
}

/// The classes that a request means: those named, all but those, or, without names, all.
/// @throws std::invalid_argument that lists the names that the table lacks.
inline ClassFilter classesOf(const ClassTable& table, const std::vector<std::string>& names, bool all_but) {
  checkBatch(names.size(), kMaxClasses, "names of classes");
  const ClassFilter named = ClassFilter::of(table, names);
  return names.empty() || all_but ? ClassFilter::allBut(named) : named;
}

}  // namespace bki_mapping::ros_interface
