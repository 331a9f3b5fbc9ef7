#include "beams/block_walk.h"

#include <algorithm>
#include <cmath>

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
  Fixed step, low, high;  ///< low to high: the extent of the segment in the slab, with the margin
};

/// Calls visit(x, y, z) for every block that has a voxel centre within `reach` of a segment, and for some
/// around those.
template <typename Visit>
void forEachBlockAlong(const GridGeometry& geometry, const Segment& segment, double reach, Visit&& visit) {
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
  SideWalk walk1(a[side1] + to_first * slope1, slope1, margin),
      walk2(a[side2] + to_first * slope2, slope2, margin);
  int block[3];
  for (block[main] = first; block[main] <= last; ++block[main], walk1.advance(), walk2.advance()) {
    const int last1 = floorOf(walk1.high), last2 = floorOf(walk2.high);
    for (block[side1] = floorOf(walk1.low); block[side1] <= last1; ++block[side1]) {
      for (block[side2] = floorOf(walk2.low); block[side2] <= last2; ++block[side2]) {
        visit(block[0], block[1], block[2]);
      }
    }
  }
}

}  // namespace

void BlockWalk::clearMarks(std::size_t count) {
  if (capacity_ < count) {
    capacity_ = 0;
    marks_ = nullptr;  // frees the old marks before allocating the new ones
    marks_ = std::make_unique<std::atomic<std::uint8_t>[]>(count);
    capacity_ = count;
  }
  for (std::size_t m = 0; m < count; ++m) marks_[m].store(0, std::memory_order_relaxed);
}

void BlockWalk::insertMarked(const Box& box, IndexNumbering& blocks) const {
  std::size_t offset = 0;
  for (int z = 0; z < box.size.z(); ++z) {
    for (int y = 0; y < box.size.y(); ++y) {
      for (int x = 0; x < box.size.x(); ++x) {
        if (marks_[offset++].load(std::memory_order_relaxed)) {
          blocks.insert({box.low.x() + x, box.low.y() + y, box.low.z() + z});
        }
      }
    }
  }
}

void BlockWalk::insertBlocksAlong(const GridGeometry& geometry, const Beams& beams, const BeamPiece& piece,
                                  double reach, std::size_t most, ThreadPool& pool, IndexNumbering& blocks) {
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
    const std::size_t before = blocks.size();
    for (std::size_t b = 0; b < beams.ends.size(); ++b) {
      const double fraction = static_cast<double>(b + 1) / static_cast<double>(beams.ends.size());
      forEachBlockAlong(geometry, segmentOf(beams, b, piece), reach, [&](int x, int y, int z) {
        blocks.insert({x, y, z});
        limitBlocks(blocks.size() - before, most, fraction);
      });
    }
    return;
  }
  const Box box{first.cast<int>(), size.cast<int>()};
  clearMarks(static_cast<std::size_t>(size.prod()));
  const Chunks chunks(beams.ends.size());
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    for (std::size_t b = chunks.begin(c); b < chunks.end(c); ++b) {
      forEachBlockAlong(geometry, segmentOf(beams, b, piece), reach, [&](int x, int y, int z) {
        // Several threads may mark a block; reading first avoids taking its cache line from the others.
        std::atomic<std::uint8_t>& mark = marks_[box.offsetOf(x, y, z)];
        if (!mark.load(std::memory_order_relaxed)) mark.store(1, std::memory_order_relaxed);
      });
    }
  });
  std::size_t marked = 0;
  for (std::size_t m = 0; m < static_cast<std::size_t>(size.prod()); ++m) {
    marked += marks_[m].load(std::memory_order_relaxed);
  }
  limitBlocks(marked, most);
  insertMarked(box, blocks);
}

void insertMappedBlocks(const SemanticMap& map, const Eigen::Vector3d& point, double range,
                        IndexNumbering& blocks) {
  const GridGeometry& geometry = map.geometry();
  const double radius = range + 0.5 * std::sqrt(3.0) * geometry.blockSize();
  map.forEachBlockNear(point, radius, [&](const BlockIndex& index) {
    if ((geometry.blockCentre(index) - point).squaredNorm() < radius * radius) blocks.insert(index);
  });
}

}  // namespace bki_mapping
