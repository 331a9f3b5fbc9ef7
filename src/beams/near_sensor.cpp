#include "beams/near_sensor.h"

#include <algorithm>
#include <cmath>

namespace bki_mapping {
namespace {

/// One beam in so many is summed to find full voxels.
constexpr std::uint32_t kOneOf = 16;
/// Blocks are near where so many of these pass a voxel, or more.
constexpr double kLeastDensity = 0.8;
/// Farther away, direction bins are no longer small beside blocks [voxels].
constexpr double kFarthest = 120.0;

/// Beams by steradian, where there are any.
double densityOf(const BeamField& field) {
  constexpr int kRows = 8, kColumns = 8;  // bins of beams are counted together in so many rows and columns
  constexpr double kSolidAngle = 4.0 * 3.14159265358979323846 * kRows * kColumns / (kBeamRows * kBeamColumns);
  int taken = 0;
  for (int row = 0; row < kBeamRows; row += kRows) {
    for (int column = 0; column < kBeamColumns; column += kColumns) {
      bool some = false;
      for (int n = row; n < row + kRows; ++n) {
        const auto cell = static_cast<std::size_t>(n * kBeamColumns + column);
        some |= field.beamsIn(cell).first < field.beamsIn(cell + kColumns - 1).last;
      }
      taken += some;
    }
  }
  return taken == 0 ? 0.0 : static_cast<double>(field.beams().ends.size()) / (taken * kSolidAngle);
}

/// The first voxel of a layer of a block, from the sensor [voxels].
Eigen::Vector3f firstOf(const Eigen::Vector3d& corner, std::size_t layer) {
  return (corner + static_cast<double>(layer) * Eigen::Vector3d::UnitZ()).cast<float>();
}

std::uint32_t roundedUp(std::uint32_t beam) {
  return (beam + kOneOf - 1) / kOneOf;
}

}  // namespace

void NearSensor::set(const BeamField& field, const LineSetups& lines, BeamWeight weight, float enough,
                     ThreadPool& pool) {
  field_ = &field;
  weight_ = weight;
  enough_ = enough;
  farthest_ = 0.0;
  if (!std::isfinite(enough)) return;
  density_ = densityOf(field);
  farthest_ = std::min(std::sqrt(density_ / (kOneOf * kLeastDensity)), kFarthest);
  some_lines_.setEvery(kOneOf, lines, field.beams().ends.size());
  directions_.set(field.beams(), field.geometry().resolution(), kernels_, pool);
  longest_.set(field, field.kernel().reach, static_cast<float>(farthest_ + kLatticeRadius), kernels_, pool);
}

void NearSensor::reserve(Workspace& own) const {
  if (!std::isfinite(enough_)) return;
  const std::size_t beams = field_->beams().ends.size();
  const std::size_t some = roundedUp(static_cast<std::uint32_t>(beams));
  own.some.reserve(some);
  own.some_ranges.reserve(std::max(BeamTable::kMostRanges, some));  // the R-tree may give each beam a range
}

Eigen::Vector3d NearSensor::cornerOf(const BlockIndex& index) const {
  const GridGeometry& geometry = field_->geometry();
  return (geometry.voxelCentre(GridGeometry::voxelOf(index, 0)) - field_->origin()) / geometry.resolution();
}

double NearSensor::distanceOf(const BlockIndex& index) const {
  return (cornerOf(index).array() + 0.5 * (kBlockEdge - 1)).matrix().norm();
}

std::uint64_t NearSensor::blocksNear(const BlockGroup& group) const {
  if (field_->boxOf(group).centre().norm() > farthest_ + kGroupVoxels) return 0;
  std::uint64_t near = 0;
  for (std::uint64_t left = group.blocks; left != 0; left &= left - 1) {
    const int n = __builtin_ctzll(left);
    const BlockIndex index{{group.index.x * kGroupEdge + n % kGroupEdge,
                            group.index.y * kGroupEdge + n / kGroupEdge % kGroupEdge,
                            group.index.z * kGroupEdge + n / (kGroupEdge * kGroupEdge)}};
    if (distanceOf(index) < farthest_) near |= std::uint64_t{1} << n;
  }
  return near;
}

void NearSensor::sumSome(const BlockGroup& group, const std::vector<BeamRange>& ranges,
                         Workspace& own) const {
  own.some_ranges.clear();
  for (const BeamRange& all : ranges) {
    const BeamRange some = {roundedUp(all.first), roundedUp(all.last)};
    if (some.first < some.last) own.some_ranges.push_back(some);
  }
  kernels_.trace_beams(some_lines_.arrays(), own.some_ranges.data(), own.some_ranges.size(),
                       field_->boxOf(group), weight_, own.some);
}

void NearSensor::dropUnreached(const BlockIndex& index, LayerBits& voxels) const {
  const Eigen::Vector3d corner = cornerOf(index);
  const float reach2 = field_->kernel().reach * field_->kernel().reach;
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  std::int32_t cells[kLayer];
  float distances2[kLayer];
  for (std::size_t layer = 0; layer < voxels.size(); ++layer) {
    if (voxels[layer] == 0) continue;
    kernels_.find_cells(firstOf(corner, layer).data(), cells, distances2);
    for (std::uint64_t left = voxels[layer]; left != 0; left &= left - 1) {
      const int v = __builtin_ctzll(left);
      // A beam that passes has the voxel's projection on it within its length, which is at least this.
      const float length = 1.00001f * longest_.at(cells[v], distances2[v]);
      if (length * length <= distances2[v] - reach2) voxels[layer] &= ~(std::uint64_t{1} << v);
    }
  }
}

bool NearSensor::look(const BlockIndex& index, const VoxelMask& is_protected, Workspace& own) const {
  const auto slot = static_cast<std::size_t>(slotInGroup(index));
  Workspace::Voxels& voxels = own.voxels[slot];
  voxels.full = {};
  alignas(64) float sums[kBlockVoxels];
  if (own.some.sumsOf({coordinateInGroup(index.x), coordinateInGroup(index.y), coordinateInGroup(index.z)},
                      1.0f, sums)) {
    limits_.find(sums, {}, enough_ * 1.001f, voxels.full.data());
  }
  const LayerBits protected_bits = bitsOf(is_protected);
  for (std::size_t n = 0; n < voxels.open.size(); ++n) voxels.open[n] = ~(voxels.full[n] | protected_bits[n]);
  dropUnreached(index, voxels.open);
  int open = 0;
  for (const std::uint64_t layer : voxels.open) open += __builtin_popcountll(layer);
  return isWorthwhile(open, index);
}

bool NearSensor::isWorthwhile(int open, const BlockIndex& index) const {
  const double distance = std::max(distanceOf(index), static_cast<double>(kBlockEdge)),
               reach = 2.0 * static_cast<double>(field_->kernel().reach);
  const double by_area = density_ / (distance * distance);              // beams that cross a voxel's face
  const double passes = by_area * (kBlockEdge + 1) * (kBlockEdge + 1);  // beams that cross the block
  const double candidates =
      by_area * (reach + distance * 2.0 / kBeamRows) * (reach + distance * 8.0 / kBeamColumns);
  // Measured, in units of what it costs to trace a beam through a block.
  constexpr double kOfVoxel = 2.5, kOfCandidate = 0.02;
  return open * (kOfVoxel + kOfCandidate * candidates) < passes;
}

bool NearSensor::sumsOf(const BlockIndex& index, Workspace& own, float* sums) const {
  const auto slot = static_cast<std::size_t>(slotInGroup(index));
  const float scale = field_->kernel().scale, much = 2.0f * enough_ * scale;
  const Eigen::Vector3d corner = cornerOf(index);
  const float reach = field_->kernel().reach;
  CellWindows windows;
  bool some = false;
  for (int layer = 0; layer < kBlockEdge; ++layer) {
    const Workspace::Voxels& voxels = own.voxels[slot];
    const std::uint64_t full = voxels.full[static_cast<std::size_t>(layer)];
    float* const to = sums + layer * kBlockEdge * kBlockEdge;
    for (int v = 0; v < kBlockEdge * kBlockEdge; ++v) to[v] = (full >> v & 1) != 0 ? much : 0.0f;
    some |= full != 0;
    if (voxels.open[static_cast<std::size_t>(layer)] == 0) continue;
    kernels_.find_windows(firstOf(corner, static_cast<std::size_t>(layer)).data(), reach, windows);
    for (std::uint64_t left = voxels.open[static_cast<std::size_t>(layer)]; left != 0; left &= left - 1) {
      const int v = __builtin_ctzll(left);
      const Eigen::Vector3d voxel = corner + Eigen::Vector3d(v % kBlockEdge, v / kBlockEdge, layer);
      if (voxel.isZero(0.0)) continue;  // rho is 0
      const std::size_t ranges = field_->rangesIn(windows, v, own.ranges);
      const float sum = scale * kernels_.sum_at(directions_.arrays(), own.ranges, ranges,
                                                SplitPointDirection(voxel), reach, weight_);
      to[v] = sum > 0.0f ? sum : 0.0f;
      some |= sum > 0.0f;
    }
  }
  return some;
}

}  // namespace bki_mapping
