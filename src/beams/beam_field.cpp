#include "beams/beam_field.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "parallel/chunks.h"

namespace bki_mapping {

BeamField::BeamField(const GridGeometry& geometry, const KernelConfig& kernel, BeamIndexType index)
    : geometry_(geometry), kernel_(kernel, geometry.resolution()), index_type_(index) {
  // A line that crosses a voxel passes its centre within half the voxel's diagonal.
  reach_ = kernel_.type == KernelType::kCounting ? kVoxelHalfDiagonal : kernel_.reach;
}

void BeamField::setBeams(const Beams& beams, ThreadPool& pool) {
  const std::size_t count = beams.ends.size();
  const Chunks chunks(count);
  cells_.resize(count);
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    for (std::size_t b = chunks.begin(c); b < chunks.end(c); ++b) {
      cells_[b] = BeamTable::cellOf(beams.ends[b]);
    }
  });
  table_.build(cells_, order_);
  beams_.origin = beams.origin;
  beams_.ends.resize(count);
  inverse_length_.resize(count);
  sorted_cells_.resize(count);
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    for (std::size_t b = chunks.begin(c); b < chunks.end(c); ++b) {
      // A local copy: reading beams_.ends[b] back would wait for the store.
      const Eigen::Vector3f beam = beams.ends[order_[b]];
      inverse_length_[b] = static_cast<float>(1.0 / beam.cast<double>().norm());
      beams_.ends[b] = beam;
      sorted_cells_[b] = cells_[order_[b]];
    }
  });
  longest_ =
      count == 0
          ? 0.0
          : 1.0 / static_cast<double>(*std::min_element(inverse_length_.begin(), inverse_length_.end()));
  if (index_type_ == BeamIndexType::kRtree) {
    std::vector<Eigen::Vector3f> directions;
    directions.reserve(count);
    for (const Eigen::Vector3f& end : beams_.ends) directions.push_back(end.normalized());
    rtree_ = makeBeamRtree(directions);
  }
}

void BeamField::reserve(NearBeams& near) const {
  const std::size_t count = beams_.ends.size();
  near.ranges.reserve(rtree_ ? count : std::min(count, BeamTable::kMostRanges));
  if (kernel_.type == KernelType::kCounting) near.beams.reserve(count);
}

BeamBox BeamField::boxOf(const BlockGroup& group) const {
  const BlockIndex first{
      {group.index.x * kGroupEdge, group.index.y * kGroupEdge, group.index.z * kGroupEdge}};
  const Eigen::Vector3d corner =
      (geometry_.voxelCentre(GridGeometry::voxelOf(first, 0)) - beams_.origin) / geometry_.resolution();
  return {{corner.x(), corner.y(), corner.z()}, static_cast<double>(reach_), group.blocks};
}

void BeamField::findRangesNear(const BlockGroup& group, NearBeams& near) const {
  // The bounding box of the group's blocks.
  Eigen::Array3d low = Eigen::Array3d::Constant(kGroupEdge), high = Eigen::Array3d::Zero();
  for (std::uint64_t left = group.blocks; left != 0; left &= left - 1) {
    const int n = __builtin_ctzll(left);
    const Eigen::Array3d block(n % kGroupEdge, n / kGroupEdge % kGroupEdge, n / (kGroupEdge * kGroupEdge));
    low = low.min(block);
    high = high.max(block + 1.0);
  }
  const BeamBox box = boxOf(group);
  const Eigen::Array3d first = Eigen::Array3d(box.first[0], box.first[1], box.first[2]) - 0.5;
  const Eigen::AlignedBox3d reached(
      ((first + kBlockEdge * low - box.reach) * geometry_.resolution()).matrix(),
      ((first + kBlockEdge * high + box.reach) * geometry_.resolution()).matrix());
  if (rtree_) return findRangesNear(reached.center(), 0.5 * reached.diagonal().norm(), near);
  table_.query(reached, near.ranges);
}

void BeamField::findRangesNear(const BlockIndex& index, NearBeams& near) const {
  const Eigen::Vector3d centre = geometry_.blockCentre(index) - beams_.origin;
  findRangesNear(centre, (kLatticeRadius + static_cast<double>(reach_)) * geometry_.resolution(), near);
}

void BeamField::findRangesNear(const Eigen::Vector3d& centre, double radius_metres, NearBeams& near) const {
  const auto radius = static_cast<float>(radius_metres);
  if (!rtree_) return table_.query(centre.cast<float>(), radius, near.ranges);
  auto& ranges = near.ranges;
  rtree_->query(centre.cast<float>(), radius, ranges);
  std::sort(ranges.begin(), ranges.end(),
            [](const BeamRange& a, const BeamRange& b) { return a.first < b.first; });
  std::size_t kept = 0;
  for (const BeamRange& range : ranges) {
    if (kept > 0 && ranges[kept - 1].last == range.first) {
      ranges[kept - 1].last = range.last;
    } else {
      ranges[kept++] = range;
    }
  }
  ranges.resize(kept);
}

std::size_t BeamField::rangesIn(const CellWindows& windows, int voxel, BeamRange* ranges) const {
  const std::vector<std::uint32_t>& begin = table_.begin();
  std::size_t count = 0;
  const auto add = [&](int row, int first, int last) {
    const auto base = static_cast<std::size_t>(row) * kBeamColumns;
    ranges[count] = {begin[base + static_cast<std::size_t>(first)],
                     begin[base + static_cast<std::size_t>(last) + 1]};
    count += ranges[count].first < ranges[count].last;
  };
  const int first = windows.first_column[voxel], last = windows.last_column[voxel];
  for (int row = windows.first_row[voxel]; row <= windows.last_row[voxel]; ++row) {
    if (first <= last) {
      add(row, first, last);
    } else {
      add(row, first, kBeamColumns - 1);
      add(row, 0, last);
    }
  }
  return count;
}

LocalBeam BeamField::localBeam(std::size_t b, const BlockIndex& index) const {
  const double resolution = geometry_.resolution();
  const Eigen::Vector3d end = beams_.ends[b].cast<double>();
  const double length = end.norm();
  Eigen::Vector3d u = end / length;
  const Eigen::Vector3d block_centre = geometry_.blockCentre(index) - beams_.origin;
  const double along = block_centre.dot(u);
  const Eigen::Vector3d n =
      (along * u - block_centre) / resolution + Eigen::Vector3d::Constant(0.5 * (kBlockEdge - 1));
  if (u.y() * u.y() + u.z() * u.z() < 1e-16) u.z() = 1e-8;  // along x: turned by 1e-8 rad, so that g > 0
  const double g = u.y() * u.y() + u.z() * u.z();
  const auto f = [](double x) { return static_cast<float>(x); };
  return {f(u.x()), f(u.y()), f(u.z()),   f(n.x()),          f(n.y()),
          f(n.z()), f(g),     f(1.0 / g), f(along / length), f(resolution / length)};
}

void BeamField::findBeamsNear(const BlockIndex& index, double follow, NearBeams& near) const {
  findRangesNear(index, near);
  // A conservative test in single precision, with a margin for its rounding.
  const Eigen::Vector3f c = (geometry_.blockCentre(index) - beams_.origin).cast<float>();
  const auto radius = static_cast<float>((kLatticeRadius + reach_) * geometry_.resolution());
  const float distance2 = c.squaredNorm(), limit2 = radius * radius + 1e-5f * distance2;
  const auto follow_to = static_cast<float>(follow);
  near.beams.clear();
  for (const BeamRange& range : near.ranges) {
    for (std::uint32_t b = range.first; b < range.last; ++b) {
      const float length = 1.0f / inverse_length_[b];
      const Eigen::Vector3f u = beams_.ends[b] * inverse_length_[b];
      const float along = c.dot(u), end = std::max(length, follow_to) + radius;
      if (distance2 - along * along < limit2 && along > -radius && along < end) near.beams.push_back(b);
    }
  }
}

bool BeamField::crosses(const BlockIndex& index, int offset, const Eigen::Vector3f& end) const {
  // Slab test of the half-line from the sensor, in double precision.
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
