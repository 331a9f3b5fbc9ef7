#include "io/voxel_points.h"

#include <algorithm>
#include <new>
#include <numeric>

#include "map/voxel_color.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kLayer = kBlockEdge * kBlockEdge;

void setColor(const Color& color, VoxelPoint& point) {
  point.rgb = std::uint32_t{color[0]} << 16 | std::uint32_t{color[1]} << 8 | color[2];
}
void setColor(const Color& color, VoxelRecord& record) {
  record.red = color[0];
  record.green = color[1];
  record.blue = color[2];
}

/// The centres of the voxels of a block along one axis [m].
using Centres = std::array<float, kBlockEdge>;

Centres centresOf(std::int32_t block, double resolution) {
  Centres centres;
  for (int n = 0; n < kBlockEdge; ++n) {
    centres[static_cast<std::size_t>(n)] = static_cast<float>((block * kBlockEdge + n + 0.5) * resolution);
  }
  return centres;
}

}  // namespace

VoxelPoints::VoxelPoints(const SemanticMap& map, const ClassTable& classes, const VoxelSelection& selection,
                         Blocks blocks, ThreadPool& pool)
    : map_(map), classes_(classes), selection_(selection), blocks_(std::move(blocks)), pool_(pool) {
  begin_.resize(blocks_.size() + 1);
  forEachBlock([this](std::size_t b) {
    const auto& [index, block] = blocks_[b];
    BlockView view;
    readBlock(map_, index, *block, BlockFields::kStates, view);
    std::size_t count = 0;
    forEachSelected(index, view, [&count](std::size_t) { ++count; });
    begin_[b + 1] = count;
  });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
}

template <typename Job>
void VoxelPoints::forEachBlock(const Job& job) const {
  constexpr std::size_t kBlocksPerJob = 64;
  pool_.forEach((blocks_.size() + kBlocksPerJob - 1) / kBlocksPerJob, [&](std::size_t part, std::size_t) {
    const std::size_t end = std::min(blocks_.size(), (part + 1) * kBlocksPerJob);
    for (std::size_t b = part * kBlocksPerJob; b < end; ++b) job(b);
  });
}

template <typename Visit>
void VoxelPoints::forEachSelected(const BlockIndex& index, const BlockView& view, const Visit& visit) const {
  const Centres z = centresOf(index.z, map_.geometry().resolution());
  for (std::size_t layer = 0; layer < kBlockEdge; ++layer) {
    const auto height = static_cast<double>(z[layer]);
    if (height < selection_.min_z || height > selection_.max_z) continue;
    for (std::size_t v = layer * kLayer; v < (layer + 1) * kLayer; ++v) {
      if (selection_.states.contains(view.state[v])) visit(v);
    }
  }
}

template <typename Point>
void VoxelPoints::writeAs(Point* to) const {
  forEachBlock([&](std::size_t b) {
    if (begin_[b + 1] > begin_[b]) writeBlock(b, to + begin_[b]);
  });
}

template <typename Point>
void VoxelPoints::writeBlock(std::size_t b, Point* to) const {
  const auto& [index, block] = blocks_[b];
  const double resolution = map_.geometry().resolution();
  const Centres x = centresOf(index.x, resolution), y = centresOf(index.y, resolution),
                z = centresOf(index.z, resolution);
  BlockView view;
  readBlock(map_, index, *block, BlockFields::kAll, view);
  forEachSelected(index, view, [&](std::size_t v) {
    Point& point = *new (to++) Point;
    point.x = x[v % kBlockEdge];
    point.y = y[v / kBlockEdge % kBlockEdge];
    point.z = z[v / kLayer];
    setColor(semanticColor(view.state[v], view.label[v], classes_), point);
    point.label = view.label[v];
    point.state = static_cast<std::uint8_t>(view.state[v]);
    point.probability = view.probability[v];
    point.occupancy = view.occupancy[v];
    point.class_probability = view.class_probability[v];
    point.variance = view.variance[v];
    point.entropy = view.entropy[v];
    point.evidence = view.evidence[v];
  });
}

template void VoxelPoints::writeAs(VoxelPoint* to) const;
template void VoxelPoints::writeAs(VoxelRecord* to) const;

}  // namespace bki_mapping
