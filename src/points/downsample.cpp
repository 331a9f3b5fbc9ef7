#include "points/downsample.h"

#include <algorithm>
#include <cmath>

#include "parallel/group_by.h"

namespace bki_mapping {
namespace {

/// A group and the position of a cell in it are packed into 32 bits.
constexpr std::uint32_t kGroupBits = 6, kCellBits = 32 - kGroupBits;
constexpr std::size_t kGroups = 1u << kGroupBits;

/// The edge of a tile [cells] that is closest to the requested one, or to an integer fraction of it if that
/// would be too large.
int tileEdge(double cell, double tile) {
  const double ratio = tile / cell;
  if (!(ratio > 1.0)) return 1;
  const double parts = std::ceil(ratio / TileGrid::kMostEdge - 1e-6);
  return std::max(1, static_cast<int>(std::lround(ratio / parts)));
}

/// Prefetch distance of points [runs].
constexpr std::ptrdiff_t kAhead = 3;

/// A hash of a tile's index that differs between neighbours.
std::size_t shortCode(const GridIndex& tile) {
  return (tile.x & 15) | (tile.y & 15) << 4 | (tile.z & 3) << 8;
}
constexpr std::size_t kShortCodes = 1024;

}  // namespace

Downsampler::Downsampler(double cell, double tile, const std::string& instruction_set)
    : kernels_(&pointKernelsFor(instruction_set)),
      merges_(cell > 0.0),
      cells_(merges_ ? cell : tile),
      edge_(merges_ ? tileEdge(cell, tile) : 1) {}

void Downsampler::start(const Eigen::Vector3d& origin, std::size_t chunks, const ThreadPool& pool,
                        bool ordered) {
  ordered_ = ordered;
  grid_.emplace(cells_, origin, edge_);
  used_ = chunks;
  queue_.start(chunks);
  tiles_.clear();
  if (chunks_.size() < chunks) chunks_.resize(chunks);
  inputs_.resize(pool.count());
  mergers_.resize(pool.count());
  // Any worker may get any chunk, so give all of them the capacity of the largest.
  std::size_t most = 0, most_tiles = 0;
  for (const Input& input : inputs_) {
    most = std::max(most, input.points_.size());
    most_tiles = std::max(most_tiles, input.tile_sizes_.capacity());
  }
  for (Input& input : inputs_) {
    input.points_.resize(most);
    input.tile_of_.resize(most);
    input.tile_sizes_.reserve(most_tiles);
  }
  for (std::size_t m = 0; m < mergers_.size(); ++m) {
    for (const CellMerger& other : mergers_) mergers_[m].reserveAs(other);
  }
}

Downsampler::Input& Downsampler::open(std::size_t chunk, std::size_t worker) {
  Input& input = inputs_[worker];
  input.owner_ = this;
  input.tiles_ = &chunks_[chunk].tiles;
  input.tiles_->clear();
  input.known_.assign(kShortCodes, {{}, kNoPosition});
  input.size_ = 0;
  input.tile_sizes_.clear();
  input.count_ = 0;
  return input;
}

std::uint32_t Downsampler::Input::findPosition(const GridIndex& tile, KnownTile& known) {
  known = {tile, tiles_->insert(tile)};
  if (known.position == tile_sizes_.size()) tile_sizes_.push_back(0);
  return known.position;
}

void Downsampler::Input::flush() {
  const std::size_t count = count_;
  owner_->kernels_->locate_cells(*owner_->grid_, {{x_, y_, z_}}, count, positions_);
  if (points_.size() < size_ + count) {
    tile_of_.resize(2 * (size_ + count));
    points_.resize(tile_of_.size());
  }
  TilePoint* const points = points_.data() + size_;
  std::uint32_t* const tile_of = tile_of_.data() + size_;
  for (std::size_t i = 0; i < count; ++i) {
    points[i].x = x_[i];
    points[i].y = y_[i];
    points[i].z = z_[i];
    points[i].cell = static_cast<std::uint16_t>(positions_.cell[i]);
    points[i].label = labels_[i];
    const GridIndex tile = positions_.tileOf(i);
    KnownTile& known = known_[shortCode(tile)];
    const bool is_known = known.index == tile && known.position != kNoPosition;
    tile_of[i] = is_known ? known.position : findPosition(tile, known);
    ++tile_sizes_[tile_of[i]];
  }
  size_ += count;
  count_ = 0;
}

void Downsampler::close(std::size_t chunk_position, std::size_t worker) {
  Chunk& chunk = chunks_[chunk_position];
  Input& input = inputs_[worker];
  input.flush();
  const std::size_t count = input.size_, tiles = chunk.tiles.size();
  chunk.begin.assign(1, 0);
  chunk.begin.insert(chunk.begin.end(), input.tile_sizes_.begin(), input.tile_sizes_.end());
  chunk.points.resize(count);
  if (ordered_) {
    chunk.offset.resize(count);
    chunk.cell_of.assign(count, kNoPosition);
  }
  groupBy(tiles, chunk.begin.data(), [&](auto&& positionOf) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t position = positionOf(input.tile_of_[i]);
      chunk.points[position] = input.points_[i];
      if (ordered_) chunk.offset[position] = static_cast<std::uint32_t>(i);
    }
  });
  queue_.finish(chunk_position, [this](std::size_t c) { collectRuns(c); });
}

void Downsampler::collectRuns(std::size_t c) {
  const std::vector<GridIndex>& tiles = chunks_[c].tiles.members();
  const std::vector<std::uint32_t>& begin = chunks_[c].begin;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    tiles_.add(tiles[t], {static_cast<std::uint32_t>(c), begin[t], begin[t + 1]});
  }
}

void Downsampler::splitIntoGroups(std::size_t points) {
  const std::size_t group_size = points / kGroups + 1;
  if (groups_.size() < kGroups) groups_.resize(kGroups);
  used_groups_ = 0;
  const auto tiles = static_cast<std::uint32_t>(tiles_.indices().size());
  for (std::uint32_t tile = 0; tile < tiles;) {
    Group& group = groups_[used_groups_++];
    group.first_tile = tile;
    for (std::size_t size = 0; tile < tiles && (size < group_size || used_groups_ == kGroups); ++tile) {
      for (const Run* run = tiles_.begin(tile); run != tiles_.end(tile); ++run) size += run->size();
    }
    group.end_tile = tile;
  }
}

void Downsampler::prefetch(const Run& run) const {
  constexpr std::uint32_t kPointsPerLine = 64 / sizeof(TilePoint), kMostLines = 8;
  const std::uint32_t end = std::min(run.end, run.begin + kMostLines * kPointsPerLine);
  const TilePoint* const points = chunks_[run.chunk].points.data();
  for (std::uint32_t i = run.begin; i < end; i += kPointsPerLine) __builtin_prefetch(points + i);
}

void Downsampler::merge(std::uint32_t g, CellMerger& merger) {
  Group& group = groups_[g];
  group.merged.resize(0);
  for (std::uint32_t tile = group.first_tile; tile < group.end_tile; ++tile) {
    const auto before = static_cast<std::uint32_t>(group.merged.size());
    std::size_t points = 0;
    for (const Run* run = tiles_.begin(tile); run != tiles_.end(tile); ++run) points += run->size();
    merger.startTile(points);
    for (const Run* run = tiles_.begin(tile); run != tiles_.end(tile); ++run) {
      Chunk& chunk = chunks_[run->chunk];
      if (tiles_.end() - run > kAhead) prefetch(run[kAhead]);
      for (std::uint32_t i = run->begin; i < run->end; ++i) {
        const std::uint32_t cell = merges_ ? merger.add(chunk.points[i]) : merger.addAsCell(chunk.points[i]);
        if (ordered_ && cell != CellMerger::kKnown) {
          chunk.cell_of[chunk.offset[i]] = g << kCellBits | (before + cell);
        }
      }
    }
    merger.finishTile(group.merged);
  }
}

void Downsampler::finish(ThreadPool& pool) {
  std::size_t points = 0;
  for (std::size_t c = 0; c < used_; ++c) points += chunks_[c].points.size();
  tiles_.sort();
  splitIntoGroups(points);
  pool.forEach(used_groups_, [&](std::size_t g, std::size_t worker) {
    merge(static_cast<std::uint32_t>(g), mergers_[worker]);
  });
  merged_.clear();
  for (std::size_t g = 0; g < used_groups_; ++g) merged_.push_back(&groups_[g].merged);
}

void Downsampler::write(const Chunk& chunk, LabelledPoints& output) const {
  std::size_t offset = chunk.output;
  for (const std::uint32_t code : chunk.cell_of) {
    if (code == kNoPosition) continue;
    const MergedPoints& merged = groups_[code >> kCellBits].merged;
    const std::size_t cell = code & ((1u << kCellBits) - 1);
    Eigen::Vector3f& point = output.points[offset];
    point.x() = merged.x[cell];
    point.y() = merged.y[cell];
    point.z() = merged.z[cell];
    output.labels[offset++] = merged.labels[cell];
  }
}

void Downsampler::inOrder(ThreadPool& pool, LabelledPoints& output) {
  std::size_t cells = 0;
  for (std::size_t c = 0; c < used_; ++c) {
    const auto& cell_of = chunks_[c].cell_of;
    chunks_[c].output = cells;
    cells +=
        cell_of.size() - static_cast<std::size_t>(std::count(cell_of.begin(), cell_of.end(), kNoPosition));
  }
  output.points.resize(cells);
  output.labels.resize(cells);
  pool.forEach(used_, [&](std::size_t c, std::size_t) { write(chunks_[c], output); });
}

}  // namespace bki_mapping
