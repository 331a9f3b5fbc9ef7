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
    : geometry_(geometry), kernel_(kernel, geometry.resolution()), beams_(std::move(beams)) {
  // A line that crosses a voxel passes its centre within half the voxel's diagonal.
  reach_ = kernel_.type == KernelType::kCounting ? 0.8660255f : kernel_.reach;
  for (const Eigen::Vector3f& end : beams_.ends) longest_ = std::max<double>(longest_, end.norm());
  index_ = makeBeamIndex(index, directionsOf(beams_));
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
