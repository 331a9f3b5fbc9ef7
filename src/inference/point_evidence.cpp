#include "bki_mapping/inference/point_evidence.h"

#include <algorithm>
#include <cmath>

namespace bki_mapping {
namespace {

/// Voxels of one axis, and of one block on it, that a point may reach.
struct AxisReach {
  int first, last;  ///< blocks
};

AxisReach blocksWithin(double point, double reach) {
  // Voxel centres are at i + 0.5 [voxels].
  const auto first = static_cast<int>(std::ceil(point - reach - 0.5));
  const auto last = static_cast<int>(std::floor(point + reach - 0.5));
  return {GridGeometry::blockOf({{first, 0, 0}}).x, GridGeometry::blockOf({{last, 0, 0}}).x};
}

/// Distance from a coordinate to the nearest voxel centre of a block, both from its first centre [voxels].
double distanceToCentres(double local) {
  return std::abs(local - std::clamp(std::round(local), 0.0, kBlockEdge - 1.0));
}

/// Adds the kernel's values about one point to the sums of a block.
void addPoint(float x, float y, float z, const VoxelKernel& kernel, float* sums) {
  const auto first = [&](float c) { return std::max(0, static_cast<int>(std::ceil(c - kernel.reach))); };
  const auto last = [&](float c) {
    return std::min(kBlockEdge - 1, static_cast<int>(std::floor(c + kernel.reach)));
  };
  for (int k = first(z); k <= last(z); ++k) {
    const float dz = static_cast<float>(k) - z;
    for (int j = first(y); j <= last(y); ++j) {
      const float dy = static_cast<float>(j) - y;
      const float yz2 = dy * dy + dz * dz;
      float* row = sums + kBlockEdge * (j + kBlockEdge * k);
      for (int i = 0; i < kBlockEdge; ++i) {
        const float dx = static_cast<float>(i) - x;
        row[i] += sparseKernel((dx * dx + yz2) * kernel.inverse_reach2) * kernel.scale;
      }
    }
  }
}

}  // namespace

PointEvidence::PointEvidence(const GridGeometry& geometry, const KernelConfig& kernel,
                             const Eigen::Vector3d& origin, const LabelledPoints& points)
    : kernel_(kernel, geometry.resolution()) {
  std::vector<std::uint32_t> bins;
  std::vector<Entry> entries;
  bins.reserve(2 * points.points.size());
  entries.reserve(2 * points.points.size());
  for (std::size_t i = 0; i < points.points.size(); ++i) {
    binPoint(geometry, origin + points.points[i].cast<double>(), points.labels[i], bins, entries);
  }
  sortByBin(bins, entries);
}

void PointEvidence::binPoint(const GridGeometry& geometry, const Eigen::Vector3d& point, ClassId label,
                             std::vector<std::uint32_t>& bins, std::vector<Entry>& entries) {
  const VoxelIndex voxel = geometry.voxelAt(point);
  if (kernel_.type == KernelType::kCounting) {
    const BlockIndex block = GridGeometry::blockOf(voxel);
    bins.push_back(blocks_.insert(block));
    entries.push_back({static_cast<float>(voxel.x - block.x * kBlockEdge),
                       static_cast<float>(voxel.y - block.y * kBlockEdge),
                       static_cast<float>(voxel.z - block.z * kBlockEdge), label});
    return;
  }
  const Eigen::Vector3d p = point / geometry.resolution();
  const double reach = kernel_.reach;
  const AxisReach bx = blocksWithin(p.x(), reach), by = blocksWithin(p.y(), reach),
                  bz = blocksWithin(p.z(), reach);
  for (int z = bz.first; z <= bz.last; ++z) {
    const double lz = p.z() - z * kBlockEdge - 0.5, dz = distanceToCentres(lz);
    for (int y = by.first; y <= by.last; ++y) {
      const double ly = p.y() - y * kBlockEdge - 0.5, dy = distanceToCentres(ly);
      for (int x = bx.first; x <= bx.last; ++x) {
        const double lx = p.x() - x * kBlockEdge - 0.5, dx = distanceToCentres(lx);
        if (dx * dx + dy * dy + dz * dz >= reach * reach) continue;
        bins.push_back(blocks_.insert({x, y, z}));
        entries.push_back({static_cast<float>(lx), static_cast<float>(ly), static_cast<float>(lz), label});
      }
    }
  }
}

void PointEvidence::sortByBin(const std::vector<std::uint32_t>& bins, const std::vector<Entry>& entries) {
  begin_.assign(blocks_.size() + 1, 0);
  for (const std::uint32_t bin : bins) ++begin_[bin + 1];
  for (std::size_t b = 0; b < blocks_.size(); ++b) begin_[b + 1] += begin_[b];
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  entries_.resize(entries.size());
  for (std::size_t i = 0; i < bins.size(); ++i) entries_[next[bins[i]]++] = entries[i];
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const auto begin = entries_.begin() + static_cast<std::ptrdiff_t>(begin_[b]);
    const auto end = entries_.begin() + static_cast<std::ptrdiff_t>(begin_[b + 1]);
    const auto byLabel = [](const Entry& a, const Entry& c) { return a.label < c.label; };
    if (!std::is_sorted(begin, end, byLabel)) std::stable_sort(begin, end, byLabel);
  }
}

void PointEvidence::collectBlocks(const SemanticMap&, IndexNumbering& touched) const {
  for (const GridIndex& block : blocks_.members()) touched.insert(block);
}

void PointEvidence::addTo(const BlockIndex& index, Block& block, EvidenceScratch& scratch) const {
  const std::uint32_t bin = blocks_.find(index);
  if (bin == IndexNumbering::kNone) return;
  for (std::size_t i = begin_[bin]; i < begin_[bin + 1];) {
    const ClassId label = entries_[i].label;
    scratch.sums.fill(0.0f);
    for (; i < begin_[bin + 1] && entries_[i].label == label; ++i) {
      const Entry& e = entries_[i];
      if (kernel_.type == KernelType::kCounting) {
        const float offset = e.x + kBlockEdge * (e.y + kBlockEdge * e.z);
        scratch.sums[static_cast<std::size_t>(offset)] += 1.0f;
      } else {
        addPoint(e.x, e.y, e.z, kernel_, scratch.sums.data());
      }
    }
    block.add(label, scratch.sums.data());
  }
}

}  // namespace bki_mapping
