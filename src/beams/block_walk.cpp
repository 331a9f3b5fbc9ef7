#include "beams/block_walk.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "parallel/chunks.h"

namespace bki_mapping {
namespace {

/// Larger boxes would take too much memory for marks [blocks].
constexpr double kMostMarks = 1 << 27;

/// A straight piece of a beam.
struct Segment {
  Eigen::Vector3d from, to;
};

Segment segmentOf(const Beams& beams, std::size_t b, const BeamPiece& piece) {
  const Eigen::Vector3d end = beams.ends[b].cast<double>();
  if (!piece.shadow) return {beams.origin, beams.origin + end};
  return {beams.origin + end, beams.origin + end * (piece.shadow_range / end.norm())};
}

/// Block coordinates in fixed point with 32 fractional bits, whose sums and floors are cheap and exact.
using Fixed = std::int64_t;
constexpr Fixed kOneBlock = Fixed{1} << 32;

Fixed toFixed(double blocks) {
  return static_cast<Fixed>(blocks * 0x1.0p32);
}
int floorOf(Fixed blocks) {
  return static_cast<int>(blocks >> 32);
}

/// The extent of a segment on one of its two side axes, from slab to slab of its main axis. A slab is one
/// block thick.
struct SideWalk {
  SideWalk(double at_first, double slope, double margin)
      : step(toFixed(slope)),
        low(toFixed(at_first + std::min(slope, 0.0) - margin * (1.0 + std::abs(slope)))),
        high(toFixed(at_first + std::max(slope, 0.0) + margin * (1.0 + std::abs(slope)))) {}
  void advance() {
    low += step;
    high += step;
  }
  /// Whether the extent, which is the same in all slabs, reaches two blocks at most.
  bool isNarrow() const { return high - low < kOneBlock; }

  Fixed step, low, high;  ///< low to high: the extent of the segment in the slab, with the margin
};

/// The slabs of a segment, `first` to `last`, and its extent in the first of them.
struct SlabWalk {
  int main, side1, side2;  ///< axes
  int first, last;
  SideWalk walk1, walk2;
};

/// The blocks that have a voxel centre within `reach` of a segment, and some around those.
SlabWalk slabsAlong(const GridGeometry& geometry, const Segment& segment, double reach) {
  // In units of blocks. Voxel centres are at least half a voxel from the block's faces.
  const double per_metre = 1.0 / geometry.blockSize();
  const double margin = std::max(0.0, reach - 0.5 * geometry.resolution()) * per_metre + 1e-6;
  const Eigen::Vector3d a = segment.from * per_metre, d = (segment.to - segment.from) * per_metre;
  int main = 0;
  d.cwiseAbs().maxCoeff(&main);
  const int side1 = (main + 1) % 3, side2 = (main + 2) % 3;
  const double inverse = d[main] != 0.0 ? 1.0 / d[main] : 0.0;
  const int first = floorToInt(std::min(a[main], a[main] + d[main]) - margin),
            last = floorToInt(std::max(a[main], a[main] + d[main]) + margin);
  const double slope1 = d[side1] * inverse, slope2 = d[side2] * inverse, to_first = first - a[main];
  return {main,
          side1,
          side2,
          first,
          last,
          {a[side1] + to_first * slope1, slope1, margin},
          {a[side2] + to_first * slope2, slope2, margin}};
}

/// Calls visit(x, y, z) for the blocks of a walk.
template <typename Visit>
void forEachBlockOf(SlabWalk walk, Visit&& visit) {
  int block[3];
  int &main = block[walk.main], &side1 = block[walk.side1], &side2 = block[walk.side2];
  for (main = walk.first; main <= walk.last; ++main, walk.walk1.advance(), walk.walk2.advance()) {
    const int last1 = floorOf(walk.walk1.high), last2 = floorOf(walk.walk2.high);
    for (side1 = floorOf(walk.walk1.low); side1 <= last1; ++side1) {
      for (side2 = floorOf(walk.walk2.low); side2 <= last2; ++side2) visit(block[0], block[1], block[2]);
    }
  }
}

/// Marks are bytes that several threads set at once, to the same value.
bool isMarked(const std::uint8_t& mark) {
  return __atomic_load_n(&mark, __ATOMIC_RELAXED) != 0;
}
void set(std::uint8_t& mark) {
  __atomic_store_n(&mark, std::uint8_t{1}, __ATOMIC_RELAXED);
}

/// Where the mark of a block is: origin + x stride[0] + y stride[1] + z stride[2].
struct MarkLayout {
  std::ptrdiff_t origin, stride[3];
};

/// Marks the blocks of a walk. Most beams reach two blocks at most along each side axis of a slab. Then a
/// slab is four marks, some of them the same, without a loop whose end the processor would have to guess; and
/// nearly always other beams have set all four.
void markBlocks(SlabWalk walk, const MarkLayout& layout, std::uint8_t* marks) {
  const std::ptrdiff_t(&stride)[3] = layout.stride;
  if (!walk.walk1.isNarrow() || !walk.walk2.isNarrow()) {
    forEachBlockOf(walk, [&](int x, int y, int z) {
      // Reading first avoids taking the mark's cache line from other threads.
      std::uint8_t& mark = marks[layout.origin + x * stride[0] + y * stride[1] + z * stride[2]];
      if (!isMarked(mark)) set(mark);
    });
    return;
  }
  const std::ptrdiff_t stride1 = stride[walk.side1], stride2 = stride[walk.side2];
  std::ptrdiff_t slab = layout.origin + walk.first * stride[walk.main];
  for (int n = walk.first; n <= walk.last; ++n, slab += stride[walk.main]) {
    const std::ptrdiff_t low = slab + floorOf(walk.walk1.low) * stride1,
                         high = slab + floorOf(walk.walk1.high) * stride1,
                         low2 = floorOf(walk.walk2.low) * stride2, high2 = floorOf(walk.walk2.high) * stride2;
    std::uint8_t* const four[4] = {marks + (low + low2), marks + (low + high2), marks + (high + low2),
                                   marks + (high + high2)};
    if (!(isMarked(*four[0]) & isMarked(*four[1]) & isMarked(*four[2]) & isMarked(*four[3]))) {
      for (std::uint8_t* const mark : four) set(*mark);
    }
    walk.walk1.advance();
    walk.walk2.advance();
  }
}

}  // namespace

void BlockWalk::clearMarks(std::size_t count) {
  constexpr std::size_t kWord = sizeof(std::uint64_t);  // listMarked() reads whole words
  if (capacity_ < count) {
    capacity_ = 0;
    marks_ = nullptr;  // frees the old marks before allocating the new ones
    marks_ = std::make_unique<std::uint8_t[]>(count + kWord);
    capacity_ = count;
  }
  std::fill_n(marks_.get(), count, std::uint8_t{0});
}

void BlockWalk::listMarked(const Box& box, std::vector<GridIndex>& blocks) const {
  constexpr int kWord = sizeof(std::uint64_t);
  const std::uint8_t* row = marks_.get();
  for (int z = 0; z < box.size.z(); ++z) {
    for (int y = 0; y < box.size.y(); ++y, row += box.size.x()) {
      for (int begin = 0; begin < box.size.x(); begin += kWord) {
        std::uint64_t word;
        __builtin_memcpy(&word, row + begin, sizeof(word));
        if (word == 0) continue;
        for (int x = begin; x < std::min(begin + kWord, box.size.x()); ++x) {
          if (row[x] != 0) blocks.push_back({box.low.x() + x, box.low.y() + y, box.low.z() + z});
        }
      }
    }
  }
}

void BlockWalk::listBlocksAlong(const GridGeometry& geometry, const Beams& beams, const BeamPiece& piece,
                                double reach, std::size_t most, ThreadPool& pool,
                                std::vector<GridIndex>& blocks) {
  if (beams.ends.empty()) return;
  Eigen::Array3d low = Eigen::Array3d::Zero(), high = Eigen::Array3d::Zero();
  for (const Eigen::Vector3f& end : beams.ends) {
    low = low.min(end.array().cast<double>());
    high = high.max(end.array().cast<double>());
  }
  if (piece.shadow) {
    low = low.min(-piece.shadow_range);
    high = high.max(piece.shadow_range);
  }
  const double margin = 3.0 * reach + 3.0 * geometry.blockSize();  // walks end at whole slabs
  const Eigen::Array3d first = ((low - margin + beams.origin.array()) / geometry.blockSize()).floor();
  const Eigen::Array3d size =
      ((high + margin + beams.origin.array()) / geometry.blockSize()).floor() + 1.0 - first;
  if (size.prod() > kMostMarks) {
    unmarked_.clear();
    for (std::size_t b = 0; b < beams.ends.size(); ++b) {
      const double fraction = static_cast<double>(b + 1) / static_cast<double>(beams.ends.size());
      forEachBlockOf(slabsAlong(geometry, segmentOf(beams, b, piece), reach), [&](int x, int y, int z) {
        unmarked_.insert({x, y, z});
        limitBlocks(unmarked_.size(), most, fraction);
      });
    }
    blocks.insert(blocks.end(), unmarked_.members().begin(), unmarked_.members().end());
    return;
  }
  const Box box{first.cast<int>(), size.cast<int>()};
  const auto count = static_cast<std::size_t>(size.prod());
  clearMarks(count);
  const std::ptrdiff_t row = box.size.x(), layer = row * box.size.y();
  const MarkLayout layout = {-(box.low.x() + box.low.y() * row + box.low.z() * layer), {1, row, layer}};
  const Chunks chunks(beams.ends.size());
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    for (std::size_t b = chunks.begin(c); b < chunks.end(c); ++b) {
      markBlocks(slabsAlong(geometry, segmentOf(beams, b, piece), reach), layout, marks_.get());
    }
  });
  limitBlocks(std::accumulate(marks_.get(), marks_.get() + count, std::size_t{0}), most);
  listMarked(box, blocks);
}

void listMappedBlocks(const SemanticMap& map, const Eigen::Vector3d& point, double range,
                      std::vector<GridIndex>& blocks) {
  const GridGeometry& geometry = map.geometry();
  const double radius = range + 0.5 * std::sqrt(3.0) * geometry.blockSize();
  map.forEachBlockNear(point, radius, [&](const BlockIndex& index) {
    if ((geometry.blockCentre(index) - point).squaredNorm() < radius * radius) blocks.push_back(index);
  });
}

}  // namespace bki_mapping
