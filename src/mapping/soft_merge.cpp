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

/// Hits of a group.
constexpr std::size_t kGroupHits = 4096;

void append(const Eigen::Vector3f& point, ClassId label, float weight, MergedPoints& group) {
  group.x.push_back(point.x());
  group.y.push_back(point.y());
  group.z.push_back(point.z());
  group.labels.push_back(label);
  group.weights.push_back(weight);
}

void addPoint(const SoftLabels& soft, const UsedPoint& used, CellShares& cell) {
  ++cell.points;
  const ClassShare* const begin = soft.begin(used.offset);
  const ClassShare* const end = soft.end(used.offset);
  for (const ClassShare* s = begin; s != end; ++s) addShare(*s, cell.sums);
  if (begin == end) addShare({used.id, 1.0f}, cell.sums);
}

}  // namespace

std::vector<MergedPoints> mergeSoftLabels(const ScanView& scan,
                                          const std::vector<std::vector<UsedPoint>>& used, double cell,
                                          const LabelledPoints& hits) {
  const GridGeometry grid(cell > 0.0 ? cell : 1.0);
  IndexNumbering cells;  // numbered in the same order as the down-sampler's
  std::vector<CellShares> shares(hits.points.size());
  std::size_t next = 0;
  for (const auto& chunk : used) {
    for (const UsedPoint& point : chunk) {
      const VoxelIndex index = grid.voxelAt(scan.origin + scan.points[point.offset].cast<double>());
      const std::size_t hit = cell > 0.0 ? cells.insert(index) : next++;
      if (hits.labels[hit] == point.id) addPoint(*scan.soft, point, shares[hit]);
    }
  }
  std::vector<MergedPoints> groups;
  if (std::all_of(shares.begin(), shares.end(), [](const auto& c) { return c.sums.size() == 1; }))
    return groups;
  for (std::size_t h = 0; h < shares.size(); ++h) {
    if (h % kGroupHits == 0) groups.emplace_back();
    const CellShares& c = shares[h];
    for (const ClassShare& s : c.sums) {
      append(hits.points[h], s.id, s.share / static_cast<float>(c.points), groups.back());
    }
  }
  return groups;
}

}  // namespace bki_mapping
