#include "bki_mapping/inference/point_evidence.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "bki_mapping/inference/axis_blocks.h"
#include "bki_mapping/inference/chunks.h"

namespace bki_mapping {
namespace {

bool isZero(float x) {
  return x == 0.0f;
}

}  // namespace

PointEvidence::PointEvidence(const GridGeometry& geometry, const KernelConfig& kernel,
                             const std::string& instruction_set)
    : geometry_(geometry),
      per_metre_(1.0 / geometry.resolution()),
      kernel_(kernel, geometry.resolution()),
      loops_(innerLoopsFor(instruction_set)) {
  const double most = kBlockEdge * (AxisBlocks::kMost - 2) / 2.0;
  if (!(kernel_.reach < most)) {
    throw std::invalid_argument("kernel/length is more than " + std::to_string(static_cast<int>(most)) +
                                " voxels; make it shorter, or resolution coarser");
  }
}

void PointEvidence::bin(const Eigen::Vector3d& point, ClassId label, Chunk& chunk) const {
  const auto append = [&](const GridIndex& block, const Eigen::Vector3d& local, int voxel) {
    const Eigen::Vector3f l = local.cast<float>();
    const LocalPoint entry{l.x(), l.y(), l.z(), label, static_cast<std::uint16_t>(voxel)};
    chunk[partitionOf(block)].push_back({block, entry});
  };
  if (kernel_.type == KernelType::kCounting) {
    const VoxelIndex voxel = geometry_.voxelAt(point);
    const int offset = GridGeometry::offsetInBlock(voxel);
    append(GridGeometry::blockOf(voxel), Eigen::Vector3d::Zero(), offset);
    return;
  }
  const Eigen::Vector3d p = point * per_metre_;
  const double reach = kernel_.reach;
  // Most points keep to one block: the neighbours' nearest centres, at -1 and 8, are out of reach.
  const VoxelIndex voxel{{floorToInt(p.x()), floorToInt(p.y()), floorToInt(p.z())}};
  const BlockIndex home = GridGeometry::blockOf(voxel);
  const int offset = GridGeometry::offsetInBlock(voxel);
  const double x = p.x() - home.x * kBlockEdge - 0.5, y = p.y() - home.y * kBlockEdge - 0.5,
               z = p.z() - home.z * kBlockEdge - 0.5;
  const double low = reach - 0.999, high = kBlockEdge - 0.001 - reach;
  if (reach >= 0.8661 && x > low && x < high && y > low && y < high && z > low && z < high) {
    append(home, {x, y, z}, offset);
    return;
  }
  const AxisBlocks xs(home.x, x, reach), ys(home.y, y, reach), zs(home.z, z, reach);
  bool at_home = false;
  for (const AxisBlock& bz : zs) {
    for (const AxisBlock& by : ys) {
      for (const AxisBlock& bx : xs) {
        if (bx.distance2 + by.distance2 + bz.distance2 >= reach * reach) continue;
        const GridIndex block{bx.block, by.block, bz.block};
        append(block, {bx.local, by.local, bz.local}, block == home ? offset : int{LocalPoint::kOutside});
        at_home |= block == home;
      }
    }
  }
  // A kernel shorter than half a voxel's diagonal may reach no centre, but the point is in its voxel still.
  if (protect_ && !at_home) append(home, {x, y, z}, offset);
}

void PointEvidence::sort(std::size_t p, std::size_t chunks) {
  Partition& partition = partitions_[p];
  partition.blocks.clear();
  partition.block_of_record.clear();
  partition.begin.assign(1, 0);
  std::uint32_t block = IndexNumbering::kNone;
  for (std::size_t c = 0; c < chunks; ++c) {
    for (const Record& record : chunks_[c][p]) {
      // Neighbours in a scan are mostly neighbours in space.
      if (block == IndexNumbering::kNone || partition.blocks.members()[block] != record.block) {
        block = partition.blocks.insert(record.block);
      }
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

void PointEvidence::start(std::size_t points, std::size_t chunks) {
  size_ = points;
  if (chunks_.size() < chunks) chunks_.resize(chunks);
  for (std::size_t c = 0; c < chunks; ++c) {
    for (auto& records : chunks_[c]) records.clear();
  }
}

void PointEvidence::setPoints(const Eigen::Vector3d& origin, const LabelledPoints& points, Workers& workers) {
  const Chunks chunks(points.points.size());
  start(points.points.size(), chunks.count());
  workers.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    for (std::size_t i = chunks.begin(c); i < chunks.end(c); ++i) {
      bin(origin + points.points[i].cast<double>(), points.labels[i], chunks_[c]);
    }
  });
  workers.forEach(kPartitions, [&](std::size_t p, std::size_t) { sort(p, chunks.count()); });
}

void PointEvidence::setPoints(const Eigen::Vector3d& origin, const Downsampler& points, Workers& workers) {
  std::size_t count = 0;
  for (std::size_t p = 0; p < Downsampler::partitions(); ++p) count += points.merged(p).size();
  start(count, Downsampler::partitions());
  workers.forEach(Downsampler::partitions(), [&](std::size_t c, std::size_t) {
    for (const Downsampler::Merged& m : points.merged(c))
      bin(origin + m.point.cast<double>(), m.label, chunks_[c]);
  });
  workers.forEach(kPartitions, [&](std::size_t p, std::size_t) { sort(p, Downsampler::partitions()); });
}

void PointEvidence::collectBlocks(const SemanticMap&, Workers&, IndexNumbering& touched) {
  for (const Partition& partition : partitions_) {
    for (const GridIndex& block : partition.blocks.members()) touched.insert(block);
  }
}

void PointEvidence::addPoints(const LocalPoint* points, std::size_t count, float* sums) const {
  if (kernel_.type == KernelType::kCounting) {
    for (std::size_t i = 0; i < count; ++i) sums[points[i].voxel] += 1.0f;
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
  for (std::size_t i = 0; protect_ && i < count; ++i) {
    if (points[i].voxel != LocalPoint::kOutside) scratch.held.set(points[i].voxel);
  }
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
  const bool limited = std::isfinite(scratch.limits.hits) && points[0].label != kFreeClass;
  if (limited) {
    scratch.sums.fill(0.0f);
    addPoints(points, count, scratch.sums.data());
    scratch.shareHits();
  }
  for (std::size_t i = 0; i < count;) {
    const std::uint32_t label = points[i].label;
    std::size_t end = one_class ? count : begin[label];
    scratch.sums.fill(0.0f);
    addPoints(points + i, end - i, scratch.sums.data());
    if (protect_evidence_) scratch.holdSums();
    if (label == kFreeClass) {
      scratch.leaveHeldAlone();
      scratch.limitFree();
    } else if (limited) {
      scratch.limitHits();
    }
    const bool nothing = protect_ && std::all_of(scratch.sums.begin(), scratch.sums.end(), isZero);
    if (!nothing) block.add(static_cast<ClassId>(label), scratch.sums.data());
    i = end;
  }
}

}  // namespace bki_mapping
