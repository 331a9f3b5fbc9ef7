#include "points/point_bins.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "bki_mapping/core/grid_geometry.h"
#include "parallel/group_by.h"
#include "update/work_limit.h"

namespace bki_mapping {
namespace {

/// A block that a point may reach, on one axis.
struct AxisBlock {
  int block;         ///< index
  double local;      ///< the point, relative to the block's first voxel centre [voxels]
  double distance2;  ///< squared distance to the block's nearest voxel centre on this axis [voxels^2]
};

/// Distance to a block's nearest voxel centre [voxels]. @param local relative to its first voxel centre.
double distanceToCentres(double local) {
  const double last = kBlockEdge - 1;
  if (local < 0.0) return -local;
  if (local > last) return local - last;
  const double above = local - floorToInt(local);
  return above < 0.5 ? above : 1.0 - above;
}

/// The blocks that have a voxel centre within reach of a point on one axis.
class AxisBlocks {
 public:
  /// @param block that contains the point. @param local the point, relative to its first voxel centre
  /// [voxels]. @param reach of the kernel [voxels].
  AxisBlocks(int block, double local, double reach) {
    const double inside = distanceToCentres(local);
    if (inside < reach) append(block, local, inside);
    // The nearest centres of preceding blocks are at -1, -9, ..., those of following blocks at 8, 16, ...
    double distance = local + 1.0;
    for (int n = 1; distance < reach; ++n, distance += kBlockEdge) {
      append(block - n, local + n * kBlockEdge, distance);
    }
    distance = kBlockEdge - local;
    for (int n = 1; distance < reach; ++n, distance += kBlockEdge) {
      append(block + n, local - n * kBlockEdge, distance);
    }
  }
  const AxisBlock* begin() const { return blocks_.data(); }
  const AxisBlock* end() const { return blocks_.data() + count_; }

  static constexpr std::size_t kMost = 20;  ///< blocks; enough for VoxelKernel::kMaxReach

 private:
  void append(int block, double local, double distance) {
    if (count_ < kMost) blocks_[count_++] = {block, local, distance * distance};
  }

  std::array<AxisBlock, kMost> blocks_;  // uninitialised, to save time
  std::size_t count_ = 0;
};

/// The offset of one of the 3 x 3 x 3 blocks around a block from that block.
struct Neighbour {
  int blocks[3];
  float voxels[3];
};
/// In the order of the bits of TilePositions::reached.
constexpr std::array<Neighbour, 27> kNeighbours = [] {
  std::array<Neighbour, 27> neighbours{};
  for (int bit = 0; bit < 27; ++bit) {
    Neighbour& offset = neighbours[static_cast<std::size_t>(bit)];
    offset = {{bit % 3 - 1, bit / 3 % 3 - 1, bit / 9 - 1}, {}};
    for (int axis = 0; axis < 3; ++axis)
      offset.voxels[axis] = static_cast<float>(kBlockEdge * offset.blocks[axis]);
  }
  return neighbours;
}();
/// The block itself.
constexpr std::size_t kContaining = 13;

/// A point is stored once for each block that it reaches; this many copies take a gigabyte.
constexpr double kMostBinned = 1 << 26;

/// Appends point i of the batch to a block. @param block position in group.blocks. @param offset of the block
/// from the point's containing block [voxels]. @param voxel offset of the point's voxel, or
/// LocalPoint::kOutside.
template <bool kWeighted, typename Scratch, typename Group>
[[gnu::always_inline]] inline void append(std::uint32_t block, std::size_t i, const float* offset,
                                          std::int32_t voxel, Scratch& scratch, Group& group) {
  if (block + 1 == group.begin.size()) group.begin.push_back(0);
  ++group.begin[block + 1];
  LocalPoint& point = scratch.points[scratch.size];
  point.x = scratch.positions.inside[0][i] - offset[0];
  point.y = scratch.positions.inside[1][i] - offset[1];
  point.z = scratch.positions.inside[2][i] - offset[2];
  point.label = scratch.labels[i];
  point.voxel = static_cast<std::uint16_t>(voxel);
  if constexpr (kWeighted) scratch.weight[scratch.size] = scratch.weights[i];
  scratch.block[scratch.size++] = block;
}

}  // namespace

PointBins::PointBins(const GridGeometry& geometry, const VoxelKernel& kernel, const PointKernels& kernels,
                     const ClassSet& confined)
    : geometry_(geometry), kernel_(kernel), kernels_(kernels), confined_(confined) {
  static_assert(kBlockEdge * (AxisBlocks::kMost - 2) >= 2.0 * VoxelKernel::kMaxReach);
}

/// For kernels that always reach the containing block, and at most its neighbours.
template <bool kWeighted>
void PointBins::binToNeighbours(std::size_t count, Scratch& scratch, Group& group) const {
  for (std::size_t i = 0; i < count; ++i) {
    const GridIndex containing = scratch.positions.tileOf(i);
    if (scratch.containing != containing) {
      scratch.containing = containing;
      scratch.neighbours.fill(kNoPosition);
    }
    auto left = static_cast<std::uint32_t>(scratch.positions.reached[i]);
    if (confined_[scratch.labels[i]]) left = 1u << kContaining;
    for (; left != 0; left &= left - 1) {
      const auto bit = static_cast<std::size_t>(__builtin_ctz(left));
      const Neighbour& offset = kNeighbours[bit];
      std::uint32_t& block = scratch.neighbours[bit];
      if (block == kNoPosition) {
        block = group.blocks.insert({containing.x + offset.blocks[0], containing.y + offset.blocks[1],
                                     containing.z + offset.blocks[2]});
      }
      append<kWeighted>(block, i, offset.voxels,
                        bit == kContaining ? scratch.positions.cell[i] : LocalPoint::kOutside, scratch,
                        group);
    }
  }
}

/// For kernels of any length.
template <bool kWeighted>
void PointBins::binToAll(std::size_t i, Scratch& scratch, Group& group) const {
  const GridIndex containing = scratch.positions.tileOf(i);
  const double reach = kernel_.reach;
  const AxisBlocks xs(containing.x, scratch.positions.inside[0][i], reach),
      ys(containing.y, scratch.positions.inside[1][i], reach),
      zs(containing.z, scratch.positions.inside[2][i], reach);
  // A long kernel may reach hundreds of blocks.
  const std::size_t needed = scratch.size + AxisBlocks::kMost * AxisBlocks::kMost * AxisBlocks::kMost + 1;
  reserve(needed, scratch);
  const auto appendToContaining = [&] {
    append<kWeighted>(group.blocks.insert(containing), i, kNeighbours[kContaining].voxels,
                      scratch.positions.cell[i], scratch, group);
  };
  if (confined_[scratch.labels[i]]) return appendToContaining();
  bool reaches_containing = false;
  for (const AxisBlock& bz : zs) {
    for (const AxisBlock& by : ys) {
      for (const AxisBlock& bx : xs) {
        if (bx.distance2 + by.distance2 + bz.distance2 >= reach * reach) continue;
        const GridIndex block{bx.block, by.block, bz.block};
        const float offset[3] = {static_cast<float>(kBlockEdge * (block.x - containing.x)),
                                 static_cast<float>(kBlockEdge * (block.y - containing.y)),
                                 static_cast<float>(kBlockEdge * (block.z - containing.z))};
        append<kWeighted>(group.blocks.insert(block), i, offset,
                          block == containing ? scratch.positions.cell[i] : LocalPoint::kOutside, scratch,
                          group);
        reaches_containing |= block == containing;
      }
    }
  }
  // A kernel shorter than half a voxel's diagonal may reach no centre.
  if (keep_containing_ && !reaches_containing) appendToContaining();
}

void PointBins::reserve(std::size_t points, Scratch& scratch) const {
  if (scratch.points.size() < points) {
    scratch.points.resize(2 * points);
    scratch.block.resize(2 * points);
  }
  if (weighted_ && scratch.weight.size() < points) scratch.weight.resize(2 * points);
}

template <bool kWeighted>
void PointBins::binBatch(std::size_t count, Scratch& scratch, Group& group) const {
  reserve(scratch.size + kNeighbours.size() * count, scratch);
  if (kernel_.type == KernelType::kCounting) {
    for (std::size_t i = 0; i < count; ++i) {
      append<kWeighted>(group.blocks.insert(scratch.positions.tileOf(i)), i, kNeighbours[kContaining].voxels,
                        scratch.positions.cell[i], scratch, group);
    }
  } else if (kernel_.reach >= kVoxelHalfDiagonal && kernel_.reach <= static_cast<float>(kBlockEdge)) {
    kernels_.reach_blocks(count, kernel_.reach, scratch.positions);
    binToNeighbours<kWeighted>(count, scratch, group);
  } else {
    for (std::size_t i = 0; i < count; ++i) binToAll<kWeighted>(i, scratch, group);
  }
}

void PointBins::sortGroup(const Scratch& scratch, Group& group) const {
  group.points.resize(scratch.size);
  group.weights.resize(weighted_ ? scratch.size : 0);
  group.classes.assign(group.blocks.size(), 0);
  groupBy(group.blocks.size(), group.begin.data(), [&](auto&& positionOf) {
    for (std::size_t i = 0; i < scratch.size; ++i) {
      const std::uint32_t block = scratch.block[i];
      const std::uint32_t position = positionOf(block);
      group.points[position] = scratch.points[i];
      if (weighted_) group.weights[position] = scratch.weight[i];
      group.classes[block] |= PointRun::classBit(scratch.points[i].label);
    }
  });
}

void PointBins::binGroup(const TileGrid& grid, const MergedPoints& points, Scratch& scratch,
                         Group& group) const {
  group.blocks.clear();
  group.begin.assign(1, 0);
  scratch.size = 0;
  scratch.neighbours.fill(kNoPosition);
  const std::size_t size = points.size();
  for (std::size_t begin = 0; begin < size; begin += kBatch) {
    const std::size_t count = std::min(size - begin, kBatch);
    const PointSpan span{{points.x.data() + begin, points.y.data() + begin, points.z.data() + begin}};
    kernels_.locate_points(grid, span, count, scratch.positions);
    scratch.labels = points.labels.data() + begin;
    if (weighted_) {
      scratch.weights = points.weights.data() + begin;
      binBatch<true>(count, scratch, group);
    } else {
      binBatch<false>(count, scratch, group);
    }
  }
  sortGroup(scratch, group);
  group.first_class = size > 0 ? points.labels[0] : ClassId{0};
  group.has_other_class = std::any_of(points.labels.begin(), points.labels.end(),
                                      [&](ClassId label) { return label != group.first_class; });
}

void PointBins::collectRuns(const Group& group) {
  one_class_ &= !group.has_other_class && group.first_class == groups_[0].first_class;
  const std::vector<GridIndex>& indices = group.blocks.members();
  for (std::size_t b = 0; b < indices.size(); ++b) {
    const std::uint32_t begin = group.begin[b];
    blocks_.add(indices[b], {group.points.data() + begin, group.begin[b + 1] - begin, group.classes[b],
                             weighted_ ? group.weights.data() + begin : nullptr});
  }
}

void PointBins::start(std::size_t groups, const ThreadPool& pool) {
  one_class_ = true;
  queue_.start(groups);
  blocks_.clear();
  if (groups_.size() < groups) groups_.resize(groups);
  scratch_.resize(pool.count());
  // Any worker may get any group, so give all of them the capacity of the largest.
  std::size_t points = 0;
  for (const Scratch& scratch : scratch_) points = std::max(points, scratch.points.size());
  for (Scratch& scratch : scratch_) {
    scratch.points.resize(points);
    scratch.block.resize(points);
    if (weighted_) scratch.weight.resize(points);
  }
}

void PointBins::setPoints(const Eigen::Vector3d& origin, const PointGroups& points, bool keep_containing,
                          ThreadPool& pool) {
  keep_containing_ = keep_containing;
  weighted_ = std::any_of(points.begin(), points.end(),
                          [](const MergedPoints* group) { return !group->weights.empty(); });
  // An estimate of the mean number of blocks that the kernel reaches.
  const double blocks_per_point =
      kernel_.type == KernelType::kCounting
          ? 1.0
          : std::pow(2.0 * static_cast<double>(kernel_.reach) / kBlockEdge + 1.0, 3.0);
  const double binned = static_cast<double>(sizeOf(points)) * blocks_per_point;
  if (binned > kMostBinned) throw TooMuchWork(TooMuchWork::What::kBlocks, binned);
  const TileGrid grid(geometry_, origin, kBlockEdge);
  start(points.size(), pool);
  pool.forEach(points.size(), [&](std::size_t g, std::size_t worker) {
    binGroup(grid, *points[g], scratch_[worker], groups_[g]);
    queue_.finish(g, [this](std::size_t next) { collectRuns(groups_[next]); });
  });
  blocks_.sort();
}

}  // namespace bki_mapping
