#include "bki_mapping/inference/point_evidence.h"

#include <algorithm>
#include <cmath>

#include "bki_mapping/inference/chunks.h"

namespace bki_mapping {
namespace {

/// The blocks of one axis that a point may reach.
struct AxisReach {
  int first, last;
};

AxisReach blocksWithin(double point, double reach) {
  // Voxel centres are at i + 0.5 [voxels]; rounded outwards.
  const int first = floorToInt(point - reach - 0.5), last = floorToInt(point + reach + 0.5);
  return {GridGeometry::blockOf({{first, 0, 0}}).x, GridGeometry::blockOf({{last, 0, 0}}).x};
}

/// Distance from a coordinate to the nearest voxel centre of a block, both from its first centre [voxels].
double distanceToCentres(double local) {
  const double last = kBlockEdge - 1;
  if (local < 0.0) return -local;
  if (local > last) return local - last;
  const double above = local - floorToInt(local);
  return above < 0.5 ? above : 1.0 - above;
}

}  // namespace

void PointEvidence::bin(const Eigen::Vector3d& point, ClassId label, Chunk& chunk) const {
  const auto append = [&](const GridIndex& block, const Eigen::Vector3d& local) {
    const Eigen::Vector3f l = local.cast<float>();
    chunk[partitionOf(block)].push_back({block, {l.x(), l.y(), l.z(), label}});
  };
  if (kernel_.type == KernelType::kCounting) {
    const VoxelIndex voxel = geometry_.voxelAt(point);
    const int offset = GridGeometry::offsetInBlock(voxel);
    append(GridGeometry::blockOf(voxel), Eigen::Vector3d(offset, 0.0, 0.0));
    return;
  }
  const Eigen::Vector3d p = point * per_metre_;
  const BlockIndex home = GridGeometry::blockOf({{floorToInt(p.x()), floorToInt(p.y()), floorToInt(p.z())}});
  const double reach = kernel_.reach;
  const auto localIn = [&p](int x, int y, int z) {
    return Eigen::Vector3d(p.x() - x * kBlockEdge - 0.5, p.y() - y * kBlockEdge - 0.5,
                           p.z() - z * kBlockEdge - 0.5);
  };
  const Eigen::Vector3d at_home = localIn(home.x, home.y, home.z);
  if (reach >= 0.8661 && (at_home.array() - reach > -0.999).all() &&
      (at_home.array() + reach < kBlockEdge - 0.001).all()) {
    append(home, at_home);  // most points: the neighbours' nearest centres, at -1 and 8, are out of reach
    return;
  }
  const AxisReach xs = blocksWithin(p.x(), reach), ys = blocksWithin(p.y(), reach),
                  zs = blocksWithin(p.z(), reach);
  for (int z = zs.first; z <= zs.last; ++z) {
    for (int y = ys.first; y <= ys.last; ++y) {
      for (int x = xs.first; x <= xs.last; ++x) {
        const Eigen::Vector3d local = localIn(x, y, z);
        const double dx = distanceToCentres(local.x()), dy = distanceToCentres(local.y()),
                     dz = distanceToCentres(local.z());
        if (dx * dx + dy * dy + dz * dz < reach * reach) append({x, y, z}, local);
      }
    }
  }
}

void PointEvidence::sort(std::size_t p, std::size_t chunks) {
  Partition& partition = partitions_[p];
  partition.blocks.clear();
  partition.block_of_record.clear();
  partition.begin.assign(1, 0);
  for (std::size_t c = 0; c < chunks; ++c) {
    for (const Record& record : chunks_[c][p]) {
      const std::uint32_t block = partition.blocks.insert(record.block);
      if (block + 1 == partition.begin.size()) partition.begin.push_back(0);
      ++partition.begin[block + 1];
      partition.block_of_record.push_back(block);
    }
  }
  for (std::size_t b = 1; b < partition.begin.size(); ++b) partition.begin[b] += partition.begin[b - 1];
  partition.points.resize(partition.begin.back());
  // Filled from the front: begin[b] runs up to the next block's begin, and is then put back.
  std::size_t i = 0;
  for (std::size_t c = 0; c < chunks; ++c) {
    for (const Record& record : chunks_[c][p]) {
      partition.points[partition.begin[partition.block_of_record[i++]]++] = record.point;
    }
  }
  std::copy_backward(partition.begin.begin(), partition.begin.end() - 1, partition.begin.end());
  partition.begin.front() = 0;
}

void PointEvidence::setPoints(const Eigen::Vector3d& origin, const LabelledPoints& points, Workers& workers) {
  const Chunks chunks(points.points.size());
  if (chunks_.size() < chunks.count()) chunks_.resize(chunks.count());
  workers.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    for (auto& records : chunks_[c]) records.clear();
    for (std::size_t i = chunks.begin(c); i < chunks.end(c); ++i) {
      bin(origin + points.points[i].cast<double>(), points.labels[i], chunks_[c]);
    }
  });
  workers.forEach(kPartitions, [&](std::size_t p, std::size_t) { sort(p, chunks.count()); });
}

void PointEvidence::collectBlocks(const SemanticMap&, Workers&, IndexNumbering& touched) {
  for (const Partition& partition : partitions_) {
    for (const GridIndex& block : partition.blocks.members()) touched.insert(block);
  }
}

void PointEvidence::addPoints(const LocalPoint* points, std::size_t count, float* sums) const {
  if (kernel_.type == KernelType::kCounting) {
    for (std::size_t i = 0; i < count; ++i) sums[static_cast<std::size_t>(points[i].x)] += 1.0f;
    return;
  }
  loops_.add_points(points, count, kernel_.reach, sums);
  for (int v = 0; v < kBlockVoxels; ++v) sums[v] *= kernel_.scale;
}

void PointEvidence::addTo(const BlockIndex& index, Block& block, EvidenceScratch& scratch) const {
  const Partition& partition = partitions_[partitionOf(index)];
  const std::uint32_t number = partition.blocks.find(index);
  if (number == IndexNumbering::kNone) return;
  const LocalPoint* points = partition.points.data() + partition.begin[number];
  const std::size_t count = partition.begin[number + 1] - partition.begin[number];
  // A counting sort by class; most blocks see two or three.
  std::array<std::uint32_t, kMaxClasses + 3> begin{};
  for (std::size_t i = 0; i < count; ++i) ++begin[points[i].label + 1];
  const bool one_class = begin[points[0].label + 1] == count;
  if (!one_class) {
    for (std::size_t label = 1; label < begin.size(); ++label) begin[label] += begin[label - 1];
    scratch.points.resize(std::max(scratch.points.size(), count));
    for (std::size_t i = 0; i < count; ++i) scratch.points[begin[points[i].label]++] = points[i];
    points = scratch.points.data();
  }
  for (std::size_t i = 0; i < count;) {
    const std::uint32_t label = points[i].label;
    std::size_t end = one_class ? count : begin[label];
    scratch.sums.fill(0.0f);
    addPoints(points + i, end - i, scratch.sums.data());
    block.add(static_cast<ClassId>(label), scratch.sums.data());
    i = end;
  }
}

}  // namespace bki_mapping
