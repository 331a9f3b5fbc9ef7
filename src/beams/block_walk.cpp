#include "beams/block_walk.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "parallel/chunks.h"

namespace bki_mapping {
namespace {

/// Larger boxes would take too much memory for marks [blocks].
constexpr double kMostMarks = 1 << 27;

/// Beams that run nearly alike make a bundle, a pyramid with its tip in the sensor, which takes hardly longer
/// to walk than one of them. It is at most so wide [blocks]: the narrower, the fewer blocks are listed that
/// no beam reaches, and the more bundles there are.
constexpr double kWidest = 0.2;

/// Pieces of beams that run nearly alike. Lengths are in blocks.
struct Bundle {
  int main;           ///< the axis along which they run most
  bool down;          ///< against it
  double begin, end;  ///< of the pieces along the main axis, from the sensor
  double last_begin;  ///< of the piece that begins last
  /// Slopes of the outermost beams along the side axes, by distance along the main one.
  double low[2], high[2];

  int sideAxis(int side) const { return (main + 1 + side) % 3; }
};

/// A bundle of one beam. @param end relative to the sensor [m].
Bundle bundleOf(const Eigen::Vector3f& end, const BeamPiece& piece, double per_metre) {
  const float x = std::abs(end.x()), y = std::abs(end.y()), z = std::abs(end.z());
  const int main = x >= y ? (x >= z ? 0 : 2) : (y >= z ? 1 : 2);
  const double along = std::abs(static_cast<double>(end[main])), inverse = along > 0.0 ? 1.0 / along : 0.0;
  Bundle bundle = {main, end[main] < 0.0f, 0.0, along * per_metre, 0.0, {}, {}};
  for (int side = 0; side < 2; ++side) {
    bundle.low[side] = bundle.high[side] = static_cast<double>(end[bundle.sideAxis(side)]) * inverse;
  }
  if (!piece.shadow) return bundle;
  const double to = bundle.end * (piece.shadow_range / end.cast<double>().norm());
  bundle.begin = bundle.last_begin = std::min(bundle.end, to);
  bundle.end = std::max(bundle.end, to);
  return bundle;
}

/// Adds a beam to a bundle unless that would make it too wide, or list blocks before where beams begin.
bool join(const Bundle& beam, Bundle& to) {
  if (beam.main != to.main || beam.down != to.down) return false;
  Bundle joined = to;
  joined.begin = std::min(to.begin, beam.begin);
  joined.last_begin = std::max(to.last_begin, beam.last_begin);
  if (joined.last_begin - joined.begin > 1.0) return false;
  joined.end = std::max(to.end, beam.end);
  for (int side = 0; side < 2; ++side) {
    joined.low[side] = std::min(to.low[side], beam.low[side]);
    joined.high[side] = std::max(to.high[side], beam.high[side]);
    if ((joined.high[side] - joined.low[side]) * joined.end > kWidest) return false;
  }
  to = joined;
  return true;
}

/// Calls visit(bundle, beam) for bundles of the beams `first` to `last` - 1. @param beam the last of a
/// bundle.
template <typename Visit>
void forEachBundle(const Beams& beams, std::size_t first, std::size_t last, const BeamPiece& piece,
                   double per_metre, Visit&& visit) {
  if (first == last) return;
  Bundle bundle = bundleOf(beams.ends[first], piece, per_metre);
  for (std::size_t b = first + 1; b < last; ++b) {
    const Bundle beam = bundleOf(beams.ends[b], piece, per_metre);
    if (join(beam, bundle)) continue;
    visit(bundle, b - 1);
    bundle = beam;
  }
  visit(bundle, last - 1);
}

/// The blocks of a slab of a bundle, one block thick: those at `main` along its main axis, and from low to
/// high along each side axis.
struct Slab {
  int main, low[2], high[2];
};

/// Calls visit(slab) for the blocks that have a voxel centre within reach of a bundle, and some around those.
/// @param origin of the beams, from the corner of a box that holds them all. @param margin reach from a
/// block's faces.
template <typename Visit>
[[gnu::always_inline]] inline void forEachSlab(const Bundle& bundle, const Eigen::Vector3d& origin,
                                               double margin, Visit&& visit) {
  const double at = origin[bundle.main], end = bundle.end + margin;
  Slab slab;
  slab.main = static_cast<int>(bundle.down ? at - bundle.begin + margin : at + bundle.begin - margin);
  double low[2], high[2];  // of the bundle, if it had no slope
  for (int side = 0; side < 2; ++side) {
    const double room = margin * (1.0 + std::max(std::abs(bundle.low[side]), std::abs(bundle.high[side])));
    low[side] = origin[bundle.sideAxis(side)] - room;
    high[side] = origin[bundle.sideAxis(side)] + room;
  }
  // The slab's near face, from the sensor.
  for (double near = bundle.down ? at - slab.main - 1.0 : slab.main - at; near <= end; near += 1.0) {
    const double from = std::min(std::max(near, bundle.begin), bundle.end),
                 to = std::min(std::max(near + 1.0, bundle.begin), bundle.end);
    for (int side = 0; side < 2; ++side) {  // coordinates in the box are not negative
      slab.low[side] = static_cast<int>(low[side] + std::min(from * bundle.low[side], to * bundle.low[side]));
      slab.high[side] =
          static_cast<int>(high[side] + std::max(from * bundle.high[side], to * bundle.high[side]));
    }
    visit(slab);
    slab.main += bundle.down ? -1 : 1;
  }
}

/// The box that holds the sensor and the ends of the beams, relative to the sensor [m].
Eigen::AlignedBox3d boxAround(const Beams& beams, const Chunks& chunks, ThreadPool& pool) {
  Eigen::AlignedBox3f boxes[Chunks::kMost];
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    Eigen::Array3f low = Eigen::Array3f::Zero(), high = Eigen::Array3f::Zero();
    for (std::size_t b = chunks.begin(c); b < chunks.end(c); ++b) {
      low = low.min(beams.ends[b].array());
      high = high.max(beams.ends[b].array());
    }
    boxes[c] = {low.matrix(), high.matrix()};
  });
  Eigen::AlignedBox3f all(Eigen::Vector3f::Zero());
  for (std::size_t c = 0; c < chunks.count(); ++c) all.extend(boxes[c]);
  return all.cast<double>();
}

/// Marks are bytes that several threads set at once, to the same value.
bool isMarked(const std::uint8_t& mark) {
  return __atomic_load_n(&mark, __ATOMIC_RELAXED) != 0;
}
void set(std::uint8_t& mark) {
  __atomic_store_n(&mark, std::uint8_t{1}, __ATOMIC_RELAXED);
}

/// Marks the blocks of a bundle. In most slabs it reaches two blocks at most along each side axis. Then a
/// slab is four marks, some of them the same, without a loop whose end the processor would have to guess; and
/// nearly always other beams have set all four.
/// @param strides from mark to mark along each axis.
void markBlocks(const Bundle& bundle, const Eigen::Vector3d& origin, double margin,
                const std::ptrdiff_t (&strides)[3], std::uint8_t* marks) {
  const std::ptrdiff_t main = strides[bundle.main], side0 = strides[bundle.sideAxis(0)],
                       side1 = strides[bundle.sideAxis(1)];
  forEachSlab(bundle, origin, margin, [&](const Slab& slab) {
    std::uint8_t* const first = marks + slab.main * main;
    if ((slab.high[0] - slab.low[0] <= 1) & (slab.high[1] - slab.low[1] <= 1)) {
      std::uint8_t *const low = first + slab.low[0] * side0, *const high = first + slab.high[0] * side0;
      std::uint8_t* const four[4] = {low + slab.low[1] * side1, low + slab.high[1] * side1,
                                     high + slab.low[1] * side1, high + slab.high[1] * side1};
      if (!(isMarked(*four[0]) & isMarked(*four[1]) & isMarked(*four[2]) & isMarked(*four[3]))) {
        for (std::uint8_t* const mark : four) set(*mark);
      }
      return;
    }
    for (int n = slab.low[0]; n <= slab.high[0]; ++n) {
      for (int m = slab.low[1]; m <= slab.high[1]; ++m) {
        // Reading first avoids taking the mark's cache line from other threads.
        std::uint8_t& mark = first[n * side0 + m * side1];
        if (!isMarked(mark)) set(mark);
      }
    }
  });
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
  const Chunks chunks(beams.ends.size());
  const Eigen::AlignedBox3d around = boxAround(beams, chunks, pool);
  Eigen::Array3d low = around.min(), high = around.max();
  if (piece.shadow) {
    low = low.min(-piece.shadow_range);
    high = high.max(piece.shadow_range);
  }
  const double margin = 3.0 * reach + 3.0 * geometry.blockSize();  // walks end at whole slabs
  const Eigen::Array3d first = ((low - margin + beams.origin.array()) / geometry.blockSize()).floor();
  const Eigen::Array3d size =
      ((high + margin + beams.origin.array()) / geometry.blockSize()).floor() + 1.0 - first;
  // In blocks. Voxel centres are at least half a voxel from the block's faces.
  const double per_metre = 1.0 / geometry.blockSize();
  const Eigen::Vector3d origin = beams.origin * per_metre - first.matrix();
  const double from_face = std::max(0.0, reach - 0.5 * geometry.resolution()) * per_metre + 1e-6;
  const Box box{first.cast<int>(), size.cast<int>()};
  if (size.prod() > kMostMarks) {
    unmarked_.clear();
    const std::size_t count = beams.ends.size();
    forEachBundle(beams, 0, count, piece, per_metre, [&](const Bundle& bundle, std::size_t beam) {
      forEachSlab(bundle, origin, from_face, [&](const Slab& slab) {
        Eigen::Array3i block;
        block[bundle.main] = slab.main;
        for (int n = slab.low[0]; n <= slab.high[0]; ++n) {
          for (int m = slab.low[1]; m <= slab.high[1]; ++m) {
            block[bundle.sideAxis(0)] = n;
            block[bundle.sideAxis(1)] = m;
            const Eigen::Array3i index = box.low + block;
            unmarked_.insert({index.x(), index.y(), index.z()});
            limitBlocks(unmarked_.size(), most, static_cast<double>(beam + 1) / static_cast<double>(count));
          }
        }
      });
    });
    blocks.insert(blocks.end(), unmarked_.members().begin(), unmarked_.members().end());
    return;
  }
  const auto count = static_cast<std::size_t>(size.prod());
  clearMarks(count);
  const std::ptrdiff_t strides[3] = {1, box.size.x(), std::ptrdiff_t{box.size.x()} * box.size.y()};
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    forEachBundle(beams, chunks.begin(c), chunks.end(c), piece, per_metre,
                  [&](const Bundle& bundle, std::size_t) {
                    markBlocks(bundle, origin, from_face, strides, marks_.get());
                  });
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
