#include "bki_mapping/query/distance_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "query/distance_kernels.h"
#include "query/voxel_rows.h"
#include "rules/neighbourhood.h"

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

/// The part of a region along an axis that a block covers.
VoxelRange within(std::int64_t block, std::int64_t min, std::int64_t size) {
  const auto clamp = [size](std::int64_t at) {
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(at, 0, size));
  };
  return {clamp(block * kBlockEdge - min), clamp((block + 1) * kBlockEdge - min)};
}

}  // namespace

/// Memory for the work on one row of all layers.
struct DistanceField::RowWork {
  explicit RowWork(const DistanceField& field)
      : row(rowScratch(field.width_)),
        squares(field.stride_),
        columns(columnScratch(field.layers_)),
        distances(kChunk * field.layers_) {}

  std::vector<std::int32_t> row, squares, columns;
  std::vector<float> distances;
};

DistanceField::DistanceField(const StateMap& states, const Eigen::AlignedBox3d& box,
                             const ObstacleRules& rules)
    : resolution_(states.geometry().resolution()), rules_(rules) {
  compute(states, box);
}

void DistanceField::compute(const StateMap& states, const Eigen::AlignedBox3d& box) {
  checkResolution(states);
  check(states.geometry(), box);
  const Eigen::Vector3d low = box.min() / resolution_, high = box.max() / resolution_;
  const VoxelRange x = overlapped(low.x(), high.x()), y = overlapped(low.y(), high.y()),
                   z = overlapped(low.z(), high.z());
  const Eigen::Vector3i size(x.end - x.begin, y.end - y.begin, z.end - z.begin);
  if (size.cast<double>().prod() > kMostVoxels || size.maxCoeff() > kMostAlongAxis) {
    throw std::invalid_argument("the region has " + std::to_string(size.x()) + " x " +
                                std::to_string(size.y()) + " x " + std::to_string(size.z()) +
                                " voxels; make it smaller, 100 million and 16384 along an axis are the most");
  }
  const auto count = [](std::int32_t n) { return static_cast<std::size_t>(n); };
  const std::size_t elements = wholeChunks(count(size.x())) * count(size.y()) * count(size.z());
  if (elements > capacity_) {
    std::unique_ptr<std::int32_t[]> along_y(new std::int32_t[elements]), in_plane(new std::int32_t[elements]);
    distances_.reset(new float[elements]);
    along_y_ = std::move(along_y);
    in_plane_ = std::move(in_plane);
    capacity_ = elements;
  }
  min_ = {{x.begin, y.begin, z.begin}};
  size_ = size;
  width_ = count(size.x());
  height_ = count(size.y());
  layers_ = count(size.z());
  stride_ = wholeChunks(width_);
  markObstacles(states);
  states.parallelFor(layers_, [&](std::size_t layer) {
    for (std::size_t chunk = 0; chunk < stride_; chunk += kChunk) {
      fastest().sweepColumns(&along_y_[rowAt(0, layer) + chunk], stride_, height_);
    }
  });
  // Row by row of a plane, so that what is found along x is still in the cache when it is needed along z.
  states.parallelFor(height_, [&](std::size_t row) {
    RowWork work(*this);
    for (std::size_t layer = 0; layer < layers_; ++layer) {
      const std::size_t at = rowAt(row, layer);
      fastest().searchRow(&along_y_[at], width_, work.row.data(), &in_plane_[at]);
    }
    for (std::size_t chunk = 0; chunk < stride_; chunk += kChunk) searchColumns(chunk, row, work);
  });
}

void DistanceField::checkResolution(const StateMap& states) const {
  if (states.geometry().resolution() != resolution_) {
    throw std::invalid_argument(
        "the map has voxels of another size than the distance field; make a new field");
  }
}

template <typename Visit>
void DistanceField::forEachVoxel(const BlockStates* block, const BlockIndex& index, Visit&& visit) {
  const VoxelRange x = within(index.x, min_.x, size_.x()), y = within(index.y, min_.y, size_.y()),
                   z = within(index.z, min_.z, size_.z());
  const bool all_classes = rules_.classes == ClassFilter::all();
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
    const VoxelRange y = within(index.y, min_.y, size_.y()), z = within(index.z, min_.z, size_.z());
    for (std::int32_t layer = z.begin; layer < z.end; ++layer) {
      const std::size_t at = rowAt(static_cast<std::size_t>(y.begin), static_cast<std::size_t>(layer));
      std::fill_n(&along_y_[at], stride_ * static_cast<std::size_t>(y.end - y.begin), 1);
    }
    for (; index.x <= last.x; ++index.x) {
      const BlockStates* const block = reader.find(index);
      if (!rules_.unknown && (!block || !block->any_occupied)) continue;
      forEachVoxel(block, index, [&](std::size_t at, bool obstacle) {
        if (obstacle) along_y_[at] = -1;
      });
    }
  });
}

void DistanceField::searchColumns(std::size_t chunk, std::size_t y, RowWork& work) {
  fastest().searchColumns(&in_plane_[rowAt(y, 0) + chunk], stride_ * height_, layers_,
                          static_cast<float>(resolution_), work.columns.data(), work.distances.data());
  const std::size_t count = std::min(kChunk, width_ - chunk);
  for (std::size_t z = 0; z < layers_; ++z) {
    std::copy_n(&work.distances[kChunk * z], count, &distances_[chunk + width_ * (y + height_ * z)]);
  }
}

void DistanceField::update(const StateMap& states, Span<const GridIndex> changed) {
  checkResolution(states);
  // What is to be recomputed: chunks of columns along y in each layer, and rows along x.
  const std::size_t chunks = stride_ / kChunk;
  std::vector<char> columns(chunks * layers_), rows(height_ * layers_);
  for (const GridIndex& index : withDependents(states.map(), states.rules(), changed)) {
    forEachVoxel(states.find({index}), {index}, [&](std::size_t at, bool obstacle) {
      if ((along_y_[at] < 0) == obstacle) return;
      along_y_[at] = -along_y_[at];
      const std::size_t row = at / stride_;
      rows[row] = 1;
      columns[at % stride_ / kChunk + chunks * (row / height_)] = 1;
    });
  }
  states.parallelFor(layers_, [&](std::size_t z) {
    std::vector<std::int32_t> before(kChunk * height_);
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
      if (!columns[chunk + chunks * z]) continue;
      std::int32_t* const first = &along_y_[rowAt(0, z) + kChunk * chunk];
      for (std::size_t y = 0; y < height_; ++y) {
        std::copy_n(first + stride_ * y, kChunk, &before[kChunk * y]);
      }
      fastest().sweepColumns(first, stride_, height_);
      for (std::size_t y = 0; y < height_; ++y) {
        const std::int32_t* const now = first + stride_ * y;
        if (!std::equal(now, now + kChunk, &before[kChunk * y])) rows[y + height_ * z] = 1;
      }
    }
  });
  states.parallelFor(height_, [&](std::size_t y) {
    RowWork work(*this);
    std::vector<char> different(chunks);
    for (std::size_t z = 0; z < layers_; ++z) {
      if (!rows[y + height_ * z]) continue;
      fastest().searchRow(&along_y_[rowAt(y, z)], width_, work.row.data(), work.squares.data());
      for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
        const std::int32_t* const squares = &work.squares[kChunk * chunk];
        std::int32_t* const known = &in_plane_[rowAt(y, z) + kChunk * chunk];
        if (std::equal(squares, squares + kChunk, known)) continue;
        std::copy_n(squares, kChunk, known);
        different[chunk] = 1;
      }
    }
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
      if (different[chunk]) searchColumns(kChunk * chunk, y, work);
    }
  });
}

bool DistanceField::contains(const VoxelIndex& voxel) const {
  const auto inside = [](std::int64_t at, std::int64_t min, int size) {
    return at >= min && at - min < size;
  };
  return inside(voxel.x, min_.x, size_.x()) && inside(voxel.y, min_.y, size_.y()) &&
         inside(voxel.z, min_.z, size_.z());
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
  for (std::size_t n = 0; n < 8; ++n) {
    const std::size_t x = n & 1, y = n >> 1 & 1, z = n >> 2;
    const float nearest = distances_[voxels[0][x] + width_ * (voxels[1][y] + height_ * voxels[2][z])];
    if (std::isinf(nearest)) return Value{nearest, Eigen::Vector3f::Zero()};
    const auto distance = static_cast<double>(nearest);
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
