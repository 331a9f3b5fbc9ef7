#include "points/soft_point_evidence.h"

#include <algorithm>

#include "points/axis_blocks.h"

namespace bki_mapping {

void SoftPointEvidence::bin(const Eigen::Vector3d& point, const ClassShare* begin, const ClassShare* end) {
  const VoxelIndex voxel = geometry_.voxelAt(point);
  const BlockIndex containing = GridGeometry::blockOf(voxel);
  const auto offset = static_cast<std::uint16_t>(GridGeometry::offsetInBlock(voxel));
  const auto append = [&](const GridIndex& block, double x, double y, double z) {
    const std::uint32_t position = blocks_.insert(block);
    if (position == records_.size()) records_.emplace_back();
    for (const ClassShare* s = begin; s != end; ++s) {
      const LocalPoint local{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z), s->id,
                             block == containing ? offset : LocalPoint::kOutside};
      records_[position].push_back({local, s->share});
    }
  };
  const Eigen::Vector3d p = point / geometry_.resolution();
  const double x = p.x() - containing.x * kBlockEdge - 0.5, y = p.y() - containing.y * kBlockEdge - 0.5,
               z = p.z() - containing.z * kBlockEdge - 0.5;
  bool reaches_containing = false;
  if (kernel_.type == KernelType::kSparse) {
    const double reach = kernel_.reach;
    for (const AxisBlock& bz : AxisBlocks(containing.z, z, reach)) {
      for (const AxisBlock& by : AxisBlocks(containing.y, y, reach)) {
        for (const AxisBlock& bx : AxisBlocks(containing.x, x, reach)) {
          if (bx.distance2 + by.distance2 + bz.distance2 >= reach * reach) continue;
          const GridIndex block{bx.block, by.block, bz.block};
          append(block, bx.local, by.local, bz.local);
          reaches_containing |= block == containing;
        }
      }
    }
  }
  if (!reaches_containing && (reports_voxels_ || kernel_.type == KernelType::kCounting))
    append(containing, x, y, z);
}

void SoftPointEvidence::setPoints(const Eigen::Vector3d& origin, const LabelledPoints& points,
                                  const SoftLabels& soft) {
  blocks_.clear();
  records_.clear();
  for (std::size_t i = 0; i < points.points.size(); ++i) {
    bin(origin + points.points[i].cast<double>(), soft.begin(i), soft.end(i));
  }
  for (auto& records : records_) {
    std::stable_sort(records.begin(), records.end(),
                     [](const Record& a, const Record& b) { return a.point.label < b.point.label; });
  }
}

const std::vector<GridIndex>& SoftPointEvidence::touchedBlocks(const SemanticMap&, std::size_t most,
                                                               ThreadPool&) {
  limitBlocks(blocks_.size(), most);
  return blocks_.members();
}

void SoftPointEvidence::markClasses(std::size_t position, ClassSet& classes) const {
  for (const Record& record : records_[position]) classes.set(record.point.label);
}

void SoftPointEvidence::sumRecord(const Record& record, float* sums) const {
  const LocalPoint& point = record.point;
  if (kernel_.type == KernelType::kCounting) {
    sums[point.voxel] += record.share;
    return;
  }
  const float weight = record.share * kernel_.scale;
  for (int v = 0; v < kBlockVoxels; ++v) {
    const float dx = static_cast<float>(v % kBlockEdge) - point.x,
                dy = static_cast<float>(v / kBlockEdge % kBlockEdge) - point.y,
                dz = static_cast<float>(v / (kBlockEdge * kBlockEdge)) - point.z;
    const float t = (dx * dx + dy * dy + dz * dz) * kernel_.inverse_reach2;
    if (t < 1.0f) sums[v] += weight * sparseKernel(t);
  }
}

void SoftPointEvidence::sumBlock(const std::vector<Record>& records, BlockSums& sums) const {
  for (std::size_t i = 0; i < records.size();) {
    const auto label = static_cast<ClassId>(records[i].point.label);
    float* const values = sums.open(label).values;
    std::fill_n(values, kBlockVoxels, 0.0f);
    for (; i < records.size() && records[i].point.label == label; ++i) {
      const std::uint16_t voxel = records[i].point.voxel;
      if (reports_voxels_ && voxel != LocalPoint::kOutside) sums.occupied.set(voxel);
      sumRecord(records[i], values);
    }
  }
}

void SoftPointEvidence::accumulate(const BlockGroup&, const std::vector<GroupBlock>& blocks, std::size_t,
                                   SumSink& sink) {
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    sumBlock(records_[blocks[b].position], sink.open(b));
    sink.close();
  }
}

}  // namespace bki_mapping
