#include "bki_mapping/query/distance_field.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "query/distance_kernels.h"
#include "query/voxel_rows.h"

namespace bki_mapping {
namespace {

const DistanceKernels& fastest() {
  static const DistanceKernels* const kernels = &distanceKernelsFor("");
  return *kernels;
}

void check(const GridGeometry& geometry, const Eigen::AlignedBox3d& box) {
  if (!box.min().allFinite() || !box.max().allFinite()) {
    throw std::invalid_argument("the region has a coordinate that is not finite; give finite ones");
  }
  if ((box.min().array() > box.max().array()).any()) {
    throw std::invalid_argument("the region is inside out; give a min below its max");
  }
  if (!geometry.contains(box.min()) || !geometry.contains(box.max())) {
    throw std::invalid_argument("the region reaches beyond the map's grid; cut it to where the map is");
  }
}

/// The obstacles of a layer of a block.
std::uint64_t obstaclesIn(const BlockStates* block, std::size_t z, const ObstacleRules& rules,
                          bool all_classes) {
  if (!block) return rules.unknown ? ~std::uint64_t{0} : 0;
  std::uint64_t obstacles = block->layers[z].occupied;
  for (std::uint64_t left = all_classes ? 0 : obstacles; left != 0; left &= left - 1) {
    const auto bit = static_cast<std::size_t>(__builtin_ctzll(left));
    if (!rules.classes.contains(block->labels[64 * z + bit])) obstacles &= ~(std::uint64_t{1} << bit);
  }
  return rules.unknown ? obstacles | ~(block->layers[z].occupied | block->layers[z].free) : obstacles;
}

}  // namespace

/// Memory for the work on one row of all layers.
struct DistanceField::RowWork {
  explicit RowWork(const DistanceField& field)
      : row(rowScratch(field.width_)),
        squares(field.stride_),
        columns(columnScratch(field.layers_)),
        distances(kChunk * field.layers_),
        changed(field.stride_ / kChunk) {}

  Squares row, squares, columns;
  std::vector<float> distances;
  std::vector<char> changed;  ///< whether searchRow() has changed a chunk
};

DistanceField::DistanceField(const StateMap& states, const Eigen::AlignedBox3d& box,
                             const ObstacleRules& rules)
    : resolution_(states.geometry().resolution()), rules_(rules) {
  check(states.geometry(), box);
  const Eigen::Vector3d low = box.min() / resolution_, high = box.max() / resolution_;
  const VoxelRange x = overlapped(low.x(), high.x()), y = overlapped(low.y(), high.y()),
                   z = overlapped(low.z(), high.z());
  min_ = {{x.begin, y.begin, z.begin}};
  size_ = {x.end - x.begin, y.end - y.begin, z.end - z.begin};
  if (size_.cast<double>().prod() > kMostVoxels || size_.maxCoeff() > kMostAlongAxis) {
    throw std::invalid_argument("the region has " + std::to_string(size_.x()) + " x " +
                                std::to_string(size_.y()) + " x " + std::to_string(size_.z()) +
                                " voxels; make it smaller, 100 million and 16384 along an axis are the most");
  }
  width_ = static_cast<std::size_t>(size_.x());
  height_ = static_cast<std::size_t>(size_.y());
  layers_ = static_cast<std::size_t>(size_.z());
  stride_ = wholeChunks(width_);
  along_y_.assign(stride_ * height_ * layers_, 1);
  in_plane_.resize(along_y_.size());
  distances_.resize(width_ * height_ * layers_);
  markObstacles(states);
  states.parallelFor(layers_, [&](std::size_t layer) {
    for (std::size_t chunk = 0; chunk < stride_; chunk += kChunk) {
      fastest().sweepColumns(along_y_.data() + rowAt(0, layer) + chunk, stride_, height_);
    }
  });
  // Row by row of a plane, so that what is found along x is still in the cache when it is needed along z.
  states.parallelFor(height_, [&](std::size_t row) {
    RowWork work(*this);
    for (std::size_t layer = 0; layer < layers_; ++layer) searchRow(row, layer, work);
    for (std::size_t chunk = 0; chunk < stride_; chunk += kChunk) searchColumns(chunk, row, work);
  });
}

template <typename Visit>
void DistanceField::forEachVoxel(const BlockStates* block, const BlockIndex& index, Visit&& visit) {
  const auto clipped = [](std::int64_t block_at, std::int64_t min, std::int64_t size) {
    const auto within = [size](std::int64_t at) {
      return static_cast<std::int32_t>(std::clamp<std::int64_t>(at, 0, size));
    };
    return VoxelRange{within(block_at * kBlockEdge - min), within((block_at + 1) * kBlockEdge - min)};
  };
  const VoxelRange x = clipped(index.x, min_.x, size_.x()), y = clipped(index.y, min_.y, size_.y()),
                   z = clipped(index.z, min_.z, size_.z());
  const bool all_classes = rules_.classes == ClassSet::all();
  constexpr std::int32_t kMask = kBlockEdge - 1;
  for (std::int32_t k = z.begin; k < z.end; ++k) {
    const std::uint64_t obstacles =
        obstaclesIn(block, static_cast<std::size_t>((min_.z + k) & kMask), rules_, all_classes);
    for (std::int32_t j = y.begin; j < y.end; ++j) {
      const std::size_t row = rowAt(static_cast<std::size_t>(j), static_cast<std::size_t>(k));
      const std::uint64_t in_row = obstacles >> kBlockEdge * ((min_.y + j) & kMask);
      for (std::int32_t i = x.begin; i < x.end; ++i) {
        visit(row + static_cast<std::size_t>(i), (in_row >> ((min_.x + i) & kMask) & 1) != 0);
      }
    }
  }
}

void DistanceField::markObstacles(const StateMap& states) {
  const BlockIndex first = GridGeometry::blockOf(min_);
  const BlockIndex last =
      GridGeometry::blockOf({{min_.x + size_.x() - 1, min_.y + size_.y() - 1, min_.z + size_.z() - 1}});
  const auto rows = static_cast<std::size_t>(last.y - first.y + 1),
             layers = static_cast<std::size_t>(last.z - first.z + 1);
  states.parallelFor(rows * layers, [&](std::size_t job) {
    BlockReader reader(states);
    BlockIndex index = {{first.x, first.y + static_cast<std::int32_t>(job % rows),
                         first.z + static_cast<std::int32_t>(job / rows)}};
    for (; index.x <= last.x; ++index.x) {
      const BlockStates* const block = reader.find(index);
      if (!rules_.unknown && (!block || !block->any_occupied)) continue;
      forEachVoxel(block, index, [&](std::size_t at, bool obstacle) { along_y_[at] = obstacle ? -1 : 1; });
    }
  });
}

void DistanceField::searchRow(std::size_t y, std::size_t z, RowWork& work) {
  fastest().searchRow(along_y_.data() + rowAt(y, z), width_, work.row.data(), work.squares.data());
  std::int32_t* const known = in_plane_.data() + rowAt(y, z);
  for (std::size_t chunk = 0; chunk < stride_; chunk += kChunk) {
    const std::int32_t* const squares = work.squares.data() + chunk;
    if (!std::equal(squares, squares + kChunk, known + chunk)) work.changed[chunk / kChunk] = 1;
  }
  std::copy(work.squares.begin(), work.squares.end(), known);
}

void DistanceField::searchColumns(std::size_t chunk, std::size_t y, RowWork& work) {
  fastest().searchColumns(in_plane_.data() + rowAt(y, 0) + chunk, stride_ * height_, layers_,
                          static_cast<float>(resolution_), work.columns.data(), work.distances.data());
  const std::size_t count = std::min(kChunk, width_ - chunk);
  for (std::size_t z = 0; z < layers_; ++z) {
    std::copy_n(work.distances.data() + kChunk * z, count,
                distances_.data() + chunk + width_ * (y + height_ * z));
  }
}

void DistanceField::update(const StateMap& states, Span<const GridIndex> changed) {
  if (states.geometry().resolution() != resolution_) {
    throw std::invalid_argument(
        "the map has voxels of another size than the distance field; make a new field");
  }
  // What is to be recomputed: chunks of columns along y in each layer, and rows along x.
  const std::size_t chunks = stride_ / kChunk;
  std::vector<char> columns(chunks * layers_), rows(height_ * layers_);
  for (const GridIndex& index : changed) {
    forEachVoxel(states.find({index}), {index}, [&](std::size_t at, bool obstacle) {
      if ((along_y_[at] < 0) == obstacle) return;
      along_y_[at] = -along_y_[at];
      const std::size_t row = at / stride_;
      rows[row] = 1;
      columns[at % stride_ / kChunk + chunks * (row / height_)] = 1;
    });
  }
  states.parallelFor(layers_, [&](std::size_t z) {
    Squares before(kChunk * height_);
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
      if (!columns[chunk + chunks * z]) continue;
      std::int32_t* const first = along_y_.data() + rowAt(0, z) + kChunk * chunk;
      for (std::size_t y = 0; y < height_; ++y) std::copy_n(first + stride_ * y, kChunk, &before[kChunk * y]);
      fastest().sweepColumns(first, stride_, height_);
      for (std::size_t y = 0; y < height_; ++y) {
        const std::int32_t* const now = first + stride_ * y;
        if (!std::equal(now, now + kChunk, &before[kChunk * y])) rows[y + height_ * z] = 1;
      }
    }
  });
  states.parallelFor(height_, [&](std::size_t y) {
    RowWork work(*this);
    for (std::size_t z = 0; z < layers_; ++z) {
      if (rows[y + height_ * z]) searchRow(y, z, work);
    }
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
      if (work.changed[chunk]) searchColumns(kChunk * chunk, y, work);
    }
  });
}

bool DistanceField::contains(const VoxelIndex& voxel) const {
  const auto within = [](std::int32_t at, std::int32_t min, int size) {
    const std::int64_t position = std::int64_t{at} - min;
    return position >= 0 && position < size;
  };
  return within(voxel.x, min_.x, size_.x()) && within(voxel.y, min_.y, size_.y()) &&
         within(voxel.z, min_.z, size_.z());
}

std::optional<DistanceField::Value> DistanceField::interpolate(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d corner(min_.x, min_.y, min_.z), at = point / resolution_ - corner;
  if (!(at.array() >= 0.0).all() || !(at.array() <= size_.cast<double>().array()).all()) return std::nullopt;
  // Of each axis, the two voxels between whose centres the point lies, and how far it is from the first.
  std::array<std::array<std::size_t, 2>, 3> voxels;
  Eigen::Array3d share;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const double last = size_[axis] - 1, beyond = std::clamp(at[axis] - 0.5, 0.0, last);
    const double first = std::max(0.0, std::min(std::floor(beyond), last - 1.0));
    voxels[static_cast<std::size_t>(axis)] = {static_cast<std::size_t>(first),
                                              static_cast<std::size_t>(std::min(first + 1.0, last))};
    share[axis] = beyond - first;
  }
  double sum = 0.0;
  Eigen::Array3d slope = Eigen::Array3d::Zero();
  for (std::size_t corner_of = 0; corner_of < 8; ++corner_of) {
    const std::size_t x = corner_of & 1, y = corner_of >> 1 & 1, z = corner_of >> 2;
    const double distance =
        static_cast<double>(distances_[voxels[0][x] + width_ * (voxels[1][y] + height_ * voxels[2][z])]);
    if (std::isinf(distance)) return Value{static_cast<float>(distance), Eigen::Vector3f::Zero()};
    const Eigen::Array3d weight(x ? share.x() : 1.0 - share.x(), y ? share.y() : 1.0 - share.y(),
                                z ? share.z() : 1.0 - share.z());
    sum += weight.prod() * distance;
    slope += distance * Eigen::Array3d((x ? 1 : -1) * weight.y() * weight.z(),
                                       (y ? 1 : -1) * weight.x() * weight.z(),
                                       (z ? 1 : -1) * weight.x() * weight.y());
  }
  return Value{static_cast<float>(sum), (slope / resolution_).cast<float>().matrix()};
}

}  // namespace bki_mapping
