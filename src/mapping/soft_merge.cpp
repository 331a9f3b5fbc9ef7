#include "mapping/soft_merge.h"

#include <algorithm>

#include "parallel/index_numbering.h"

namespace bki_mapping {
namespace {

struct CellShares {
  std::vector<ClassShare> sums;  ///< of the shares, sorted by class
  std::uint32_t points = 0;      ///< number of points added
};

void addShare(const ClassShare& share, std::vector<ClassShare>& sums) {
  const auto position = std::lower_bound(sums.begin(), sums.end(), share,
                                         [](const auto& a, const auto& b) { return a.id < b.id; });
  if (position != sums.end() && position->id == share.id) {
    position->share += share.share;
  } else {
    sums.insert(position, share);
  }
}

void addPoint(const SoftLabels& soft, const UsedPoint& used, CellShares& cell) {
  ++cell.points;
  const ClassShare* const begin = soft.begin(used.offset);
  const ClassShare* const end = soft.end(used.offset);
  for (const ClassShare* s = begin; s != end; ++s) addShare(*s, cell.sums);
  if (begin == end) addShare({used.id, 1.0f}, cell.sums);
}

}  // namespace

void mergeSoftLabels(const Scan& scan, const std::vector<std::vector<UsedPoint>>& used, double cell,
                     const LabelledPoints& hits, SoftLabels& soft) {
  const GridGeometry grid(cell > 0.0 ? cell : 1.0);
  IndexNumbering cells;  // numbered in the same order as the down-sampler's
  std::vector<CellShares> shares(hits.points.size());
  std::size_t next = 0;
  for (const auto& chunk : used) {
    for (const UsedPoint& point : chunk) {
      const VoxelIndex index = grid.voxelAt(scan.origin + scan.points[point.offset].cast<double>());
      const std::size_t hit = cell > 0.0 ? cells.insert(index) : next++;
      if (hits.labels[hit] == point.id) addPoint(scan.soft, point, shares[hit]);
    }
  }
  soft.clear();
  if (std::all_of(shares.begin(), shares.end(), [](const auto& c) { return c.sums.size() == 1; })) return;
  for (const CellShares& c : shares) {
    soft.startPoint();
    for (const ClassShare& s : c.sums) soft.add({s.id, s.share / static_cast<float>(c.points)});
  }
}

}  // namespace bki_mapping
