#include "bki_mapping/inference/block_walk.h"

#include <algorithm>
#include <cmath>

namespace bki_mapping {
namespace {

int blockAt(double coordinate) {
  return static_cast<int>(std::floor(coordinate));
}

}  // namespace

void insertBlocksAlong(const GridGeometry& geometry, const Eigen::Vector3d& from, const Eigen::Vector3d& to,
                       double reach, IndexNumbering& blocks) {
  // In units of blocks. Voxel centres keep half a voxel from the block's faces.
  const double size = geometry.blockSize();
  const double margin = std::max(0.0, reach - 0.5 * geometry.resolution()) / size + 1e-9;
  const Eigen::Vector3d a = from / size, d = (to - from) / size;
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
        blocks.insert({block[0], block[1], block[2]});
      }
    }
  }
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
