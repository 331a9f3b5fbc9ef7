#include <Eigen/Geometry>
#include <algorithm>
#include <stdexcept>

#include "bki_mapping/query/queries.h"
#include "queries.h"
#include "requests.h"

namespace bki_mapping::ros_interface {
namespace {

/// Class ids by how bad it is to hit them: those that live, those that can move, other obstacles, ground, and
/// what navigation ignores.
std::vector<ClassId> worstFirst(const ClassTable& table) {
  const auto rank = [](const SemanticClass& c) {
    return c.living ? 0 : c.dynamic ? 1 : c.ground ? 3 : c.ignored ? 4 : 2;
  };
  std::vector<SemanticClass> classes = table.classes();
  std::stable_sort(classes.begin(), classes.end(),
                   [&](const SemanticClass& a, const SemanticClass& b) { return rank(a) < rank(b); });
  std::vector<ClassId> order;
  for (const SemanticClass& each : classes) order.push_back(each.id);
  return order;
}

std::vector<ClassId> orderOf(const ClassTable& table, const std::vector<std::string>& names) {
  if (names.empty()) return worstFirst(table);
  checkBatch(names.size(), kMaxClasses, "names in worst_first");
  std::vector<ClassId> order;
  for (const std::string& name : names) order.push_back(ClassFilter::of(table, {name}).ids().front());
  return order;
}

/// @throws std::invalid_argument without a finite position and a rotation.
Eigen::Isometry3d toPose(const geometry_msgs::Pose& pose) {
  const Eigen::Quaterniond given(pose.orientation.w, pose.orientation.x, pose.orientation.y,
                                 pose.orientation.z);
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  if (!given.coeffs().isZero(0.0)) {
    constexpr double kRounding = 1e-3;  // of clients that compute in single precision
    if (!(std::abs(given.norm() - 1.0) <= kRounding)) {
      throw std::invalid_argument(
          "the orientation is not a rotation; give a quaternion of length 1, or zeros");
    }
    rotation = given.normalized();
  }
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = rotation.toRotationMatrix();
  result.translation() = toVector(pose.position);
  return result;
}

class SpaceReader {
 public:
  SpaceReader(const QueriedMap& map, const CheckSpace::Request& asked) : map_(map), asked_(asked) {}

  /// @throws std::invalid_argument.
  SpaceContent read(std::size_t n) {
    if (!asked_.radii.empty()) {
      const double radius = valueFor(asked_.radii, n);
      count(Eigen::Vector3d::Constant(radius));
      return contentOf(map_.states, Sphere{toVector(asked_.poses[n].position), radius});
    }
    const Eigen::Vector3d half = 0.5 * toVector(valueFor(asked_.sizes, n));
    const Eigen::Isometry3d pose = toPose(asked_.poses[n]);
    count(pose.linear().cwiseAbs() * half);
    return contentOf(map_.states, OrientedBox{pose, half});
  }

 private:
  /// Counts the voxels of the upright box around a shape. @param half extents of that box [m].
  void count(const Eigen::Vector3d& half) {
    voxels_ += (2.0 * half.array() / map_.states.geometry().resolution() + 1.0).prod();
    if (voxels_ > CheckSpace::Request::MOST_VOXELS) {
      throw std::invalid_argument("the shapes of the call span more than " +
                                  numberText(CheckSpace::Request::MOST_VOXELS) + " voxels; split it");
    }
  }

  const QueriedMap& map_;
  const CheckSpace::Request& asked_;
  double voxels_ = 0.0;
};

}  // namespace

void query(const QueriedMap& map, const CheckSpace::Request& asked, CheckSpace::Response& answer) {
  const std::size_t count = asked.poses.size();
  checkBatch(count, CheckSpace::Request::MOST_SHAPES, "shapes");
  if (asked.sizes.empty() == asked.radii.empty()) {
    throw std::invalid_argument("the shapes are neither boxes nor spheres; give either sizes or radii");
  }
  asked.radii.empty() ? checkCount(asked.sizes, count, "sizes") : checkCount(asked.radii, count, "radii");
  const ClassFilter obstacles = classesOf(map.classes, asked.classes, asked.all_but);
  const std::vector<ClassId> order = orderOf(map.classes, asked.worst_first);
  answer.header = map.header;
  SpaceReader reader(map, asked);
  for (std::size_t n = 0; n < count; ++n) {
    SpaceContent content;
    try {
      content = reader.read(n);
    } catch (const std::invalid_argument& fault) {
      throw std::invalid_argument("shape " + std::to_string(n) + ": " + fault.what());
    }
    const std::optional<ClassId> worst = content.worst(order);
    answer.free.push_back(content.isKnown() && !content.classes.intersects(obstacles));
    answer.known.push_back(content.isKnown());
    answer.worst_class.push_back(worst ? map.classes.nameOf(*worst) : "");
    answer.free_voxels.push_back(static_cast<std::uint32_t>(content.free));
    answer.occupied_voxels.push_back(static_cast<std::uint32_t>(content.occupied));
    answer.unknown_voxels.push_back(static_cast<std::uint32_t>(content.unknown));
  }
}

}  // namespace bki_mapping::ros_interface
