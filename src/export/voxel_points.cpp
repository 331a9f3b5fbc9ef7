#include "export/voxel_points.h"

#include <algorithm>
#include <new>
#include <numeric>

#include "export/display_colors.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kLayer = kBlockEdge * kBlockEdge;

void setColor(const Color& color, VoxelPoint& point) {
  point.rgb = std::uint32_t{color[0]} << 16 | std::uint32_t{color[1]} << 8 | color[2];
}
template <typename Record>
void setColor(const Color& color, Record& record) {
  record.red = color[0];
  record.green = color[1];
  record.blue = color[2];
}

/// The centres of the voxels of a block along one axis, relative to an origin [m].
template <typename Coordinate>
std::array<Coordinate, kBlockEdge> centresOf(std::int32_t block, double resolution, double origin) {
  std::array<Coordinate, kBlockEdge> centres;
  for (int n = 0; n < kBlockEdge; ++n) {
    const double centre = (block * kBlockEdge + n + 0.5) * resolution;
    centres[static_cast<std::size_t>(n)] = static_cast<Coordinate>(centre - origin);
  }
  return centres;
}

}  // namespace

VoxelPoints::VoxelPoints(const SemanticMap& map, const StateRules& rules, const ClassTable& classes,
                         const VoxelSelection& selection, Blocks blocks, ThreadPool& pool)
    : map_(map),
      rules_(rules),
      classes_(classes),
      selection_(selection),
      blocks_(std::move(blocks)),
      pool_(pool) {
  begin_.resize(blocks_.size() + 1);
  forEachBlock([this](std::size_t b) {
    const auto& [index, block] = blocks_[b];
    BlockView view;
    readBlock(map_, rules_, index, *block, BlockFields::kStates, view);
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
  const auto z = centresOf<double>(index.z, map_.geometry().resolution(), 0.0);
  for (std::size_t layer = 0; layer < kBlockEdge; ++layer) {
    if (z[layer] < selection_.min_z || z[layer] > selection_.max_z) continue;
    for (std::size_t v = layer * kLayer; v < (layer + 1) * kLayer; ++v) {
      if (selection_.states.contains(view.state[v])) visit(v);
    }
  }
}

template <typename Point>
void VoxelPoints::writeAs(Point* to, const Eigen::Vector3d& origin) const {
  forEachBlock([&](std::size_t b) {
    if (begin_[b + 1] > begin_[b]) writeBlock(b, to + begin_[b], origin);
  });
}

template <typename Point>
void VoxelPoints::writeBlock(std::size_t b, Point* to, const Eigen::Vector3d& origin) const {
  const auto& [index, block] = blocks_[b];
  const double resolution = map_.geometry().resolution();
  using Coordinate = decltype(Point::x);
  const auto x = centresOf<Coordinate>(index.x, resolution, origin.x()),
             y = centresOf<Coordinate>(index.y, resolution, origin.y()),
             z = centresOf<Coordinate>(index.z, resolution, origin.z());
  BlockView view;
  readBlock(map_, rules_, index, *block, BlockFields::kAll, view);
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

template void VoxelPoints::writeAs(VoxelPoint* to, const Eigen::Vector3d& origin) const;
template void VoxelPoints::writeAs(VoxelRecord* to, const Eigen::Vector3d& origin) const;
template void VoxelPoints::writeAs(FloatVoxelRecord* to, const Eigen::Vector3d& origin) const;

Eigen::Vector3d placeOf(const GridGeometry& geometry, const VoxelPoints::Blocks& blocks) {
  if (blocks.empty()) return Eigen::Vector3d::Zero();
  return geometry.blockCentre(blocks[blocks.size() / 2].first);
}

}  // namespace bki_mapping
