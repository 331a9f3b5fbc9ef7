#include "bki_mapping/inference/beam_field.h"

#include <limits>
#include <utility>

namespace bki_mapping {
namespace {

std::vector<Eigen::Vector3f> directionsOf(const Beams& beams) {
  std::vector<Eigen::Vector3f> directions;
  directions.reserve(beams.ends.size());
  for (const Eigen::Vector3f& end : beams.ends) directions.push_back(end.normalized());
  return directions;
}

}  // namespace

BeamField::BeamField(const GridGeometry& geometry, const KernelConfig& kernel, BeamIndexType index,
                     Beams beams)
    : geometry_(geometry), kernel_(kernel, geometry.resolution()) {
  // A line that crosses a voxel passes its centre within half the voxel's diagonal.
  reach_ = kernel_.type == KernelType::kCounting ? 0.8660255f : kernel_.reach;
  beams_.origin = beams.origin;
  std::vector<Eigen::Vector3f> directions;
  for (const std::uint32_t b : sortedByDirection(directionsOf(beams))) {
    const Eigen::Vector3d end = beams.ends[b].cast<double>();
    const double length = end.norm();
    beams_.ends.push_back(beams.ends[b]);
    directions_.push_back(end / length);
    directions.push_back(beams.ends[b].normalized());
    ux_.push_back(directions.back().x());
    uy_.push_back(directions.back().y());
    uz_.push_back(directions.back().z());
    length_.push_back(static_cast<float>(length));
    longest_ = std::max(longest_, length);
  }
  index_ = makeBeamIndex(index, directions);
}

int BeamField::laneOf(std::size_t b) const {
  int lane = 0;
  directions_[b].cwiseAbs().maxCoeff(&lane);
  return lane;
}

LocalBeam BeamField::localBeam(std::size_t b, const BlockIndex& index, int lane) const {
  const double resolution = geometry_.resolution();
  const Eigen::Vector3d block_centre = geometry_.blockCentre(index) - beams_.origin;
  const auto turned = [lane](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(v[lane], v[(lane + 1) % 3], v[(lane + 2) % 3]);
  };
  const double along = block_centre.dot(directions_[b]);
  const Eigen::Vector3d to_line = along * directions_[b] - block_centre;
  const Eigen::Vector3d n = turned(to_line) / resolution + Eigen::Vector3d::Constant(0.5 * (kBlockEdge - 1));
  Eigen::Vector3d u = turned(directions_[b]);
  if (u.y() * u.y() + u.z() * u.z() < 1e-16) u.z() = 1e-8;  // along x: turned by 1e-8 rad, so that g > 0
  const double g = u.y() * u.y() + u.z() * u.z();
  const auto f = [](double x) { return static_cast<float>(x); };
  return {f(u.x()),
          f(u.y()),
          f(u.z()),
          f(n.x()),
          f(n.y()),
          f(n.z()),
          f(g),
          f(1.0 / g),
          f(along) / length_[b],
          f(resolution) / length_[b]};
}

void BeamField::findBeamsNear(const BlockIndex& index, double follow, EvidenceScratch& scratch) const {
  const Eigen::Vector3d centre = geometry_.blockCentre(index) - beams_.origin;
  const Eigen::Vector3f c = centre.cast<float>();
  const auto radius = static_cast<float>((kLatticeRadius + reach_) * geometry_.resolution());
  index_->query(c, radius, scratch.ranges);

  // A first look in single precision, with room for its rounding.
  const float distance2 = c.squaredNorm(), limit2 = radius * radius + 1e-5f * distance2;
  const auto follow_to = static_cast<float>(follow);
  std::size_t candidates = 0, found = 0;
  for (const BeamRange& range : scratch.ranges) candidates += range.last - range.first;
  if (scratch.beams.size() < candidates) scratch.beams.resize(candidates);
  for (const BeamRange& range : scratch.ranges) {
    for (std::uint32_t b = range.first; b < range.last; ++b) {
      const float along = c.x() * ux_[b] + c.y() * uy_[b] + c.z() * uz_[b];
      const float end = (length_[b] > follow_to ? length_[b] : follow_to) + radius;
      scratch.beams[found] = b;
      found += (distance2 - along * along < limit2) & (along > -radius) & (along < end);
    }
  }
  scratch.beams.resize(found);
}

bool BeamField::crosses(const BlockIndex& index, int offset, const Eigen::Vector3f& end) const {
  // Slab test of the half-line in double precision, relative to the sensor.
  const Eigen::Vector3d centre = geometry_.voxelCentre(GridGeometry::voxelOf(index, offset)) - beams_.origin;
  const double half = 0.5 * geometry_.resolution();
  double enter = 0.0, leave = std::numeric_limits<double>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const double low = centre[axis] - half, high = centre[axis] + half, slope = end[axis];
    if (slope == 0.0) {
      if (low > 0.0 || high < 0.0) return false;
      continue;
    }
    enter = std::max(enter, std::min(low / slope, high / slope));
    leave = std::min(leave, std::max(low / slope, high / slope));
  }
  return enter <= leave;
}

}  // namespace bki_mapping
