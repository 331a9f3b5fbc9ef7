// The points of a block by class, and the sums of the counting kernel; those of the sparse kernel are in
// point_kernels_inl.h.
#include "points/point_evidence.h"

#include <algorithm>

#include "parallel/group_by.h"

namespace bki_mapping {
namespace {

/// How far ahead points are prefetched [blocks].
constexpr std::size_t kBlocksAhead = 2;

}  // namespace

PointEvidence::PointEvidence(const GridGeometry& geometry, const KernelConfig& kernel, bool reports_voxels,
                             const ClassSet& confined, const std::string& instruction_set)
    : kernel_(kernel, geometry.resolution()),
      kernels_(pointKernelsFor(instruction_set)),
      confined_(confined),
      bins_(geometry, kernel_, kernels_, confined),
      reports_voxels_(reports_voxels) {}

void PointEvidence::setPoints(const Eigen::Vector3d& origin, const PointGroups& points, ThreadPool& pool) {
  size_ = sizeOf(points);
  bins_.setPoints(origin, points, reports_voxels_, pool);
}

const std::vector<GridIndex>& PointEvidence::touchedBlocks(const SemanticMap&, std::size_t most,
                                                           ThreadPool&) {
  limitBlocks(bins_.blocks().size(), most);
  return bins_.blocks().members();
}

void PointEvidence::markClasses(std::size_t position, ClassSet& classes) const {
  if (bins_.oneClass()) {
    classes.set(bins_.begin(position)->points->label);
    return;
  }
  std::uint64_t bits = 0;
  for (const PointRun* run = bins_.begin(position); run != bins_.end(position); ++run) bits |= run->classes;
  constexpr std::uint64_t kShared = std::uint64_t{1} << PointRun::kSharedBit;
  for (std::uint64_t left = bits & ~kShared; left != 0; left &= left - 1) {
    classes.set(static_cast<std::size_t>(__builtin_ctzll(left)));
  }
  if ((bits & kShared) == 0) return;
  for (const PointRun* run = bins_.begin(position); run != bins_.end(position); ++run) {
    for (std::size_t i = 0; i < run->count; ++i) classes.set(run->points[i].label);
  }
}

void PointEvidence::reserve(std::size_t workers) {
  std::size_t most = 0;
  for (const Workspace& each : workspaces_) most = std::max(most, each.points.size());
  for (std::size_t block = 0; block < bins_.blocks().size() && !bins_.oneClass(); ++block) {
    std::size_t count = 0;
    for (const PointRun* run = bins_.begin(block); run != bins_.end(block); ++run) count += run->count;
    most = std::max(most, count);
  }
  workspaces_.resize(workers);
  for (Workspace& each : workspaces_) {
    each.points.resize(most);
    if (bins_.weighted()) each.weights.resize(most);
  }
}

void PointEvidence::sumClass(ClassId label, const PointRun* runs, std::size_t count, BlockSums& sums) const {
  BlockSums::Plane& plane = sums.open(label);
  if (kernel_.type == KernelType::kSparse && !confined_[label]) {
    plane.layers = kernels_.sum_points(runs, count, kernel_.reach, kernel_.scale, plane.values);
    return;
  }
  std::fill_n(plane.values, kBlockVoxels, 0.0f);
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  plane.layers = {kBlockEdge, 0};  // runs are not empty
  for (const PointRun* run = runs; run != runs + count; ++run) {
    for (std::size_t i = 0; i < run->count; ++i) {
      const int voxel = run->points[i].voxel, layer = voxel / kLayer;
      plane.values[voxel] += run->weights == nullptr ? kernel_.total : kernel_.total * run->weights[i];
      plane.layers = {std::min(plane.layers.begin, layer), std::max(plane.layers.end, layer + 1)};
    }
  }
}

std::size_t PointEvidence::sortByClass(std::size_t block, Workspace& workspace, ClassBegins& begin) const {
  begin.fill(0);
  const PointRun* const runs = bins_.begin(block);
  const PointRun* const runs_end = bins_.end(block);
  std::size_t last = 0;
  for (const PointRun* run = runs; run != runs_end; ++run) {
    for (std::size_t i = 0; i < run->count; ++i) {
      const std::size_t label = run->points[i].label;
      ++begin[label + 1];
      last = std::max(last, label);
    }
  }
  groupBy(last + 1, begin.data(), [&](auto&& positionOf) {
    for (const PointRun* run = runs; run != runs_end; ++run) {
      for (std::size_t i = 0; i < run->count; ++i) {
        const std::uint32_t position = positionOf(run->points[i].label);
        workspace.points[position] = run->points[i];
        if (run->weights != nullptr) workspace.weights[position] = run->weights[i];
      }
    }
  });
  return begin[last + 1];
}

void PointEvidence::sumBlock(std::size_t block, Workspace& workspace, BlockSums& sums) const {
  const PointRun* const runs = bins_.begin(block);
  const auto run_count = static_cast<std::size_t>(bins_.end(block) - runs);
  for (const PointRun* run = runs; reports_voxels_ && run != runs + run_count; ++run) {
    for (std::size_t i = 0; i < run->count; ++i) {
      if (run->points[i].voxel != LocalPoint::kOutside) sums.occupied.set(run->points[i].voxel);
    }
  }
  if (bins_.oneClass()) {
    sumClass(static_cast<ClassId>(runs->points->label), runs, run_count, sums);
    return;
  }
  ClassBegins begin;
  const std::size_t count = sortByClass(block, workspace, begin);
  for (std::size_t i = 0; i < count;) {
    const auto label = static_cast<ClassId>(workspace.points[i].label);
    const PointRun run{workspace.points.data() + i, begin[label + 1] - i, 0,
                       bins_.weighted() ? workspace.weights.data() + i : nullptr};
    sumClass(label, &run, 1, sums);
    i = begin[label + 1];
  }
}

void PointEvidence::prefetch(std::size_t block) const {
  constexpr std::size_t kPointsPerLine = 64 / sizeof(LocalPoint), kMostLines = 16;
  for (const PointRun* run = bins_.begin(block); run != bins_.end(block); ++run) {
    const std::size_t end = std::min(run->count, kMostLines * kPointsPerLine);
    for (std::size_t i = 0; i < end; i += kPointsPerLine) __builtin_prefetch(run->points + i);
  }
}

void PointEvidence::accumulate(const BlockGroup&, const std::vector<GroupBlock>& blocks, std::size_t worker,
                               SumSink& sink) {
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (b + kBlocksAhead < blocks.size()) prefetch(blocks[b + kBlocksAhead].position);
    sink.add(b, [&](BlockSums& sums) { sumBlock(blocks[b].position, workspaces_[worker], sums); });
  }
}

}  // namespace bki_mapping
