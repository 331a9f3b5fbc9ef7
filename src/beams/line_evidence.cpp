// The blocks that beams touch, and the sums of the counting kernel; those of the sparse kernel are in
// raster/line_kernels_inl.h.
#include "beams/line_evidence.h"

#include <algorithm>

namespace bki_mapping {
namespace {

/// Adds the weights of beams to the voxels that they cross. Collects some projections first, so that the
/// vector loop computes their weights: the only definition of the weights is raster/beam_weight_inl.h.
class CrossingSums {
 public:
  CrossingSums(BeamWeight weight, const LineKernels& kernels, float* sums)
      : weight_(weight), kernels_(kernels), sums_(sums) {}

  void add(int voxel, float rho) {
    voxels_[count_] = voxel;
    rho_[count_] = rho;
    if (++count_ == kWeighed) flush();
  }
  void flush() {
    kernels_.weigh(weight_, rho_);
    for (std::size_t n = 0; n < count_; ++n) sums_[voxels_[n]] += rho_[n];
    count_ = 0;
  }

 private:
  BeamWeight weight_;
  const LineKernels& kernels_;
  float* sums_;
  std::size_t count_ = 0;
  int voxels_[kWeighed];
  float rho_[kWeighed] = {};  // all of them are weighed
};

/// Scales sums. @return whether any sum is above 0. The loop has no branch, so that compilers vectorise it.
bool scaleSums(float scale, float* sums) {
  unsigned some = 0;
  for (int v = 0; v < kBlockVoxels; ++v) {
    const float sum = sums[v] * scale;
    sums[v] = sum > 0.0f ? sum : 0.0f;  // rounding can make the tail of the kernel slightly negative
    some |= sum > 0.0f ? 1u : 0u;
  }
  return some != 0;
}

}  // namespace

void LineEvidence::setField(const BeamField& field, ThreadPool& pool) {
  field_ = &field;
  if (field.kernel().type == KernelType::kCounting) return;
  lines_.set(field.beams(), field.geometry().resolution(), field.reachMetres(), kernels_, pool);
}

const std::vector<GridIndex>& LineEvidence::touchedBlocks(const SemanticMap& map, std::size_t most,
                                                          ThreadPool& pool) {
  const double reach = field_->reachMetres();
  touched_.clear();
  if (field_->kernel().type == KernelType::kSparse) {
    near_sensor_.set(*field_, lines_, weight_, enough_ / field_->kernel().scale, pool);
  }
  if (extent_ == FreeSpaceExtent::kMapped) {
    listMappedBlocks(map, field_->origin(), field_->longest() + reach, touched_);
  } else {
    walk_.listBlocksAlong(field_->geometry(), field_->beams(), BeamPiece(), reach, most, pool, touched_);
  }
  return touched_;
}

void LineEvidence::reserve(std::size_t workers) {
  workspaces_.resize(workers);
  for (Workspace& each : workspaces_) {
    field_->reserve(each.near);
    if (field_->kernel().type == KernelType::kSparse) {
      each.group.reserve(field_->beams().ends.size());
      near_sensor_.reserve(each.near_sensor);
    }
  }
}

double LineEvidence::cost(const BlockGroup& group) const {
  // The number of beams, in proportion to the solid angle of the group as seen from the sensor.
  return 1.0 / std::max(field_->boxOf(group).centre().squaredNorm(), BeamBox::kHalf * BeamBox::kHalf);
}

void LineEvidence::countCrossings(const BlockIndex& index, NearBeams& near, float* sums) const {
  std::fill_n(sums, kBlockVoxels, 0.0f);
  CrossingSums crossings(weight_, kernels_, sums);
  field_->forEachVoxelNear(index, 0.0, near,
                           [&](int offset, float rho, float) { crossings.add(offset, rho); });
  crossings.flush();
}

void LineEvidence::accumulate(const BlockGroup& group, const std::vector<GroupBlock>& blocks,
                              std::size_t worker, SumSink& sink) {
  Workspace& own = workspaces_[worker];
  const bool counting = field_->kernel().type == KernelType::kCounting;
  if (!counting) {
    field_->findRangesNear(group, own.near);
    near_sensor_.start(group, blocks, own.near.ranges, own.near_sensor,
                       [&](std::size_t b) { return sink.protectedOf(b); });
    const BlockGroup others = {group.index, group.blocks & ~own.near_sensor.blocks};
    if (others.blocks != 0) {
      kernels_.trace_beams(lines_.arrays(), own.near.ranges.data(), own.near.ranges.size(),
                           field_->boxOf(others), weight_, own.group);
    }
  }
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const BlockIndex& index = blocks[b].index;
    sink.add(b, [&](BlockSums& sums) {
      float* const values = sums.open(kFreeClass).values;
      const float scale = field_->kernel().scale;
      bool some;
      if (counting) {
        countCrossings(index, own.near, values);
        some = scaleSums(scale, values);
      } else if ((own.near_sensor.blocks >> slotInGroup(index) & 1) != 0) {
        some = near_sensor_.sumsOf(index, own.near_sensor, values);
      } else {
        some = own.group.sumsOf(
            {coordinateInGroup(index.x), coordinateInGroup(index.y), coordinateInGroup(index.z)}, scale,
            values);
      }
      if (!some) sums.drop();
    });
  }
}

}  // namespace bki_mapping
