#include "points/point_bins.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "parallel/group_by.h"
#include "points/axis_blocks.h"
#include "update/work_limit.h"

namespace bki_mapping {
namespace {

constexpr std::uint32_t kNone = IndexNumbering::kNone;
/// A kernel longer than this reaches a centre of its own voxel wherever the point is: half a diagonal
/// [voxels].
constexpr float kHalfDiagonal = 0.8661f;

/// The 3 x 3 x 3 blocks around one, as TilePlaces::reached numbers them.
struct Away {
  int blocks[3];
  float voxels[3];
};
constexpr std::array<Away, 27> kAway = [] {
  std::array<Away, 27> around{};
  for (int code = 0; code < 27; ++code) {
    Away& away = around[static_cast<std::size_t>(code)];
    away = {{code % 3 - 1, code / 3 % 3 - 1, code / 9 - 1}, {}};
    for (int axis = 0; axis < 3; ++axis)
      away.voxels[axis] = static_cast<float>(kBlockEdge * away.blocks[axis]);
  }
  return around;
}();
constexpr std::size_t kHome = 13;

/// A point is kept in each block that it reaches; this many take a gigabyte.
constexpr double kMostBinned = 1 << 26;

/// Appends point i of the batch to a block. @param away of the block from the point's own [voxels].
template <typename Scratch, typename Group>
[[gnu::always_inline]] inline void append(std::uint32_t block, std::size_t i, const float* away,
                                          std::int32_t voxel, Scratch& scratch, Group& group) {
  if (block + 1 == group.begin.size()) group.begin.push_back(0);
  ++group.begin[block + 1];
  LocalPoint& point = scratch.points[scratch.size];
  point.x = scratch.places.inside[0][i] - away[0];
  point.y = scratch.places.inside[1][i] - away[1];
  point.z = scratch.places.inside[2][i] - away[2];
  point.label = scratch.labels[i];
  point.voxel = static_cast<std::uint16_t>(voxel);
  scratch.block[scratch.size++] = block;
}

}  // namespace

PointBins::PointBins(const GridGeometry& geometry, const VoxelKernel& kernel, const PointKernels& kernels)
    : geometry_(geometry), kernel_(kernel), kernels_(kernels) {
  const double most = kBlockEdge * (AxisBlocks::kMost - 2) / 2.0;
  if (kernel_.type == KernelType::kSparse && !(kernel_.reach < most)) {
    throw std::invalid_argument("kernel/length is more than " + std::to_string(static_cast<int>(most)) +
                                " voxels; make it shorter, or resolution coarser");
  }
}

/// For kernels that reach the blocks next to a point's own and no others.
void PointBins::binNear(std::size_t count, Scratch& scratch, Group& group) const {
  for (std::size_t i = 0; i < count; ++i) {
    const GridIndex home = scratch.places.tileOf(i);
    if (scratch.home != home) {
      scratch.home = home;
      scratch.near.fill(kNone);
    }
    for (auto left = static_cast<std::uint32_t>(scratch.places.reached[i]); left != 0; left &= left - 1) {
      const auto code = static_cast<std::size_t>(__builtin_ctz(left));
      const Away& away = kAway[code];
      std::uint32_t& near = scratch.near[code];
      if (near == kNone)
        near =
            group.blocks.insert({home.x + away.blocks[0], home.y + away.blocks[1], home.z + away.blocks[2]});
      append(near, i, away.voxels, code == kHome ? scratch.places.cell[i] : LocalPoint::kOutside, scratch,
             group);
    }
  }
}

/// For any kernel.
void PointBins::binFar(std::size_t i, Scratch& scratch, Group& group) const {
  const GridIndex home = scratch.places.tileOf(i);
  const double reach = kernel_.reach;
  const AxisBlocks xs(home.x, scratch.places.inside[0][i], reach),
      ys(home.y, scratch.places.inside[1][i], reach), zs(home.z, scratch.places.inside[2][i], reach);
  // A kernel may reach hundreds of blocks.
  const std::size_t room = scratch.size + AxisBlocks::kMost * AxisBlocks::kMost * AxisBlocks::kMost + 1;
  if (scratch.points.size() < room) {
    scratch.block.resize(room);
    scratch.points.resize(room);
  }
  bool at_home = false;
  for (const AxisBlock& bz : zs) {
    for (const AxisBlock& by : ys) {
      for (const AxisBlock& bx : xs) {
        if (bx.distance2 + by.distance2 + bz.distance2 >= reach * reach) continue;
        const GridIndex block{bx.block, by.block, bz.block};
        const float away[3] = {static_cast<float>(kBlockEdge * (block.x - home.x)),
                               static_cast<float>(kBlockEdge * (block.y - home.y)),
                               static_cast<float>(kBlockEdge * (block.z - home.z))};
        append(group.blocks.insert(block), i, away,
               block == home ? scratch.places.cell[i] : LocalPoint::kOutside, scratch, group);
        at_home |= block == home;
      }
    }
  }
  // A kernel shorter than half a voxel's diagonal may reach no centre, but the point is in its voxel still.
  if (home_always_ && !at_home) {
    append(group.blocks.insert(home), i, kAway[kHome].voxels, scratch.places.cell[i], scratch, group);
  }
}

void PointBins::binBatch(std::size_t count, Scratch& scratch, Group& group) const {
  const std::size_t room = scratch.size + 27 * count;
  if (scratch.points.size() < room) {
    scratch.points.resize(2 * room);
    scratch.block.resize(2 * room);
  }
  if (kernel_.type == KernelType::kCounting) {
    for (std::size_t i = 0; i < count; ++i) {
      append(group.blocks.insert(scratch.places.tileOf(i)), i, kAway[kHome].voxels, scratch.places.cell[i],
             scratch, group);
    }
  } else if (kernel_.reach >= kHalfDiagonal && kernel_.reach <= static_cast<float>(kBlockEdge)) {
    kernels_.reach_blocks(count, kernel_.reach, scratch.places);
    binNear(count, scratch, group);
  } else {
    for (std::size_t i = 0; i < count; ++i) binFar(i, scratch, group);
  }
}

void PointBins::sortGroup(const Scratch& scratch, Group& group) const {
  group.points.resize(scratch.size);
  group.classes.assign(group.blocks.size(), 0);
  groupBy(group.blocks.size(), group.begin.data(), [&](auto&& positionOf) {
    for (std::size_t i = 0; i < scratch.size; ++i) {
      const std::uint32_t block = scratch.block[i];
      group.points[positionOf(block)] = scratch.points[i];
      group.classes[block] |= PointRun::classBit(scratch.points[i].label);
    }
  });
}

void PointBins::binGroup(const TileGrid& grid, const MergedPoints& points, Scratch& scratch,
                         Group& group) const {
  group.blocks.clear();
  group.begin.assign(1, 0);
  scratch.size = 0;
  scratch.near.fill(kNone);
  const std::size_t size = points.size();
  for (std::size_t begin = 0; begin < size; begin += kBatch) {
    const std::size_t count = std::min(size - begin, kBatch);
    const PointSpan span{{points.x.data() + begin, points.y.data() + begin, points.z.data() + begin}};
    kernels_.place_points(grid, span, count, scratch.places);
    scratch.labels = points.labels.data() + begin;
    binBatch(count, scratch, group);
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
    blocks_.add(indices[b], {group.points.data() + group.begin[b], group.begin[b + 1] - group.begin[b],
                             group.classes[b]});
  }
}

void PointBins::start(std::size_t groups, const ThreadPool& pool) {
  one_class_ = true;
  turns_.start(groups);
  blocks_.clear();
  if (groups_.size() < groups) groups_.resize(groups);
  scratch_.resize(pool.count());
  // Who gets which group is chance: all have room for what one has met.
  std::size_t points = 0;
  for (const Scratch& scratch : scratch_) points = std::max(points, scratch.points.size());
  for (Scratch& scratch : scratch_) {
    scratch.points.resize(points);
    scratch.block.resize(points);
  }
}

void PointBins::setPoints(const Eigen::Vector3d& origin, const Downsampler& points, bool home_always,
                          ThreadPool& pool) {
  home_always_ = home_always;
  // A ball about a point meets so many blocks in the mean.
  const double blocks_a_point =
      kernel_.type == KernelType::kCounting
          ? 1.0
          : std::pow(2.0 * static_cast<double>(kernel_.reach) / kBlockEdge + 1.0, 3.0);
  const double binned = static_cast<double>(points.size()) * blocks_a_point;
  if (binned > kMostBinned) throw TooMuchWork(TooMuchWork::What::kBlocks, binned);
  const TileGrid grid(geometry_, origin, kBlockEdge);
  start(points.groups(), pool);
  pool.forEach(points.groups(), [&](std::size_t g, std::size_t worker) {
    binGroup(grid, points.merged(g), scratch_[worker], groups_[g]);
    turns_.finish(g, [this](std::size_t next) { collectRuns(groups_[next]); });
  });
  blocks_.sort();
}

}  // namespace bki_mapping
