#include "bki_mapping/inference/block_walk.h"

#include <algorithm>
#include <cmath>

namespace bki_mapping {
namespace {

int blockAt(double coordinate) {
  return static_cast<int>(std::floor(coordinate));
}

/// Calls visit(x, y, z) for every block with a voxel centre within `reach` of a segment, and for some around
/// those.
template <typename Visit>
void forEachBlockAlong(const GridGeometry& geometry, const Segment& segment, double reach, Visit&& visit) {
  // In units of blocks. Voxel centres keep half a voxel from the block's faces.
  const double size = geometry.blockSize();
  const double margin = std::max(0.0, reach - 0.5 * geometry.resolution()) / size + 1e-9;
  const Eigen::Vector3d a = segment.from / size, d = (segment.to - segment.from) / size;
  int main = 0;
  d.cwiseAbs().maxCoeff(&main);
  const int side1 = (main + 1) % 3, side2 = (main + 2) % 3;
  const double low = std::min(a[main], a[main] + d[main]), high = std::max(a[main], a[main] + d[main]);

  for (int slab = blockAt(low - margin); slab <= blockAt(high + margin); ++slab) {
    // The piece of the segment that is within `margin` of this slab of blocks.
    double s0 = 0.0, s1 = 1.0;
    if (d[main] != 0.0) {
      const double t0 = (slab - margin - a[main]) / d[main], t1 = (slab + 1 + margin - a[main]) / d[main];
      s0 = std::clamp(std::min(t0, t1), 0.0, 1.0);
      s1 = std::clamp(std::max(t0, t1), 0.0, 1.0);
    }
    const auto range = [&](int axis) {
      const double p = a[axis] + s0 * d[axis], q = a[axis] + s1 * d[axis];
      return std::pair<int, int>(blockAt(std::min(p, q) - margin), blockAt(std::max(p, q) + margin));
    };
    const auto [first1, last1] = range(side1);
    const auto [first2, last2] = range(side2);
    int block[3];
    block[main] = slab;
    for (block[side1] = first1; block[side1] <= last1; ++block[side1]) {
      for (block[side2] = first2; block[side2] <= last2; ++block[side2]) {
        visit(block[0], block[1], block[2]);
      }
    }
  }
}

/// Blocks of a box, each marked or not: a hash table would be slower for the many blocks that beams share.
class BlockMarks {
 public:
  static constexpr double kMostBlocks = 1 << 27;

  BlockMarks(const Eigen::Array3i& low, const Eigen::Array3i& size)
      : low_(low), size_(size), marks_(static_cast<std::size_t>(size.cast<std::int64_t>().prod()), 0) {}
  void mark(int x, int y, int z) {
    marks_[static_cast<std::size_t>(x - low_.x()) +
           static_cast<std::size_t>(size_.x()) *
               (static_cast<std::size_t>(y - low_.y()) +
                static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(z - low_.z()))] = 1;
  }
  void insertInto(IndexNumbering& blocks) const {
    std::size_t place = 0;
    for (int z = 0; z < size_.z(); ++z) {
      for (int y = 0; y < size_.y(); ++y) {
        for (int x = 0; x < size_.x(); ++x) {
          if (marks_[place++]) blocks.insert({low_.x() + x, low_.y() + y, low_.z() + z});
        }
      }
    }
  }

 private:
  Eigen::Array3i low_, size_;
  std::vector<std::uint8_t> marks_;
};

}  // namespace

void insertBlocksAlong(const GridGeometry& geometry, const std::vector<Segment>& segments, double reach,
                       IndexNumbering& blocks) {
  if (segments.empty()) return;
  Eigen::Array3d low = segments.front().from.array(), high = low;
  for (const Segment& segment : segments) {
    low = low.min(segment.from.array()).min(segment.to.array());
    high = high.max(segment.from.array()).max(segment.to.array());
  }
  const Eigen::Array3d first = ((low - reach) / geometry.blockSize()).floor() - 1.0;
  const Eigen::Array3d count = ((high + reach) / geometry.blockSize()).floor() + 2.0 - first;
  if (count.prod() > BlockMarks::kMostBlocks) {
    const auto insert = [&](int x, int y, int z) { blocks.insert({x, y, z}); };
    for (const Segment& segment : segments) forEachBlockAlong(geometry, segment, reach, insert);
    return;
  }
  BlockMarks marks(first.cast<int>(), count.cast<int>());
  const auto mark = [&](int x, int y, int z) { marks.mark(x, y, z); };
  for (const Segment& segment : segments) forEachBlockAlong(geometry, segment, reach, mark);
  marks.insertInto(blocks);
}

void insertMappedBlocks(const SemanticMap& map, const Eigen::Vector3d& point, double range,
                        IndexNumbering& blocks) {
  const GridGeometry& geometry = map.geometry();
  const double radius = range + 0.5 * std::sqrt(3.0) * geometry.blockSize();
  for (const auto& entry : map.entries()) {
    if ((geometry.blockCentre(entry.index) - point).squaredNorm() < radius * radius)
      blocks.insert(entry.index);
  }
}

}  // namespace bki_mapping
