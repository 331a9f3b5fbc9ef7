#include "bki_mapping/inference/beam_evidence.h"

#include <algorithm>

#include "bki_mapping/inference/block_walk.h"

namespace bki_mapping {
namespace {

float weightAt(BeamWeight weight, float rho) {
  if (!(rho > 0.0f && rho < 1.0f)) return 0.0f;
  switch (weight) {
    case BeamWeight::kLinear:
      return rho;
    case BeamWeight::kBilinear:
      return std::min(rho, 1.0f - rho);
    default:
      return 1.0f;
  }
}

}  // namespace

void BeamEvidence::collectBlocks(const SemanticMap& map, IndexNumbering& touched) const {
  const Beams& beams = field_->beams();
  if (extent_ == FreeSpaceExtent::kMapped) {
    insertMappedBlocks(map, beams.origin, field_->longest() + field_->reachMetres(), touched);
    return;
  }
  std::vector<Segment> segments;
  segments.reserve(beams.ends.size());
  for (const Eigen::Vector3f& end : beams.ends)
    segments.push_back({beams.origin, beams.origin + end.cast<double>()});
  insertBlocksAlong(field_->geometry(), segments, field_->reachMetres(), touched);
}

void BeamEvidence::addLines(const BlockIndex& index, EvidenceScratch& scratch) const {
  const VoxelKernel& kernel = field_->kernel();
  field_->findBeamsNear(index, 0.0, scratch);
  for (auto& beams : scratch.local_beams) beams.clear();
  for (const std::uint32_t b : scratch.beams) {
    const int lane = field_->laneOf(b);
    scratch.local_beams[static_cast<std::size_t>(lane)].push_back(field_->localBeam(b, index, lane));
  }
  for (std::size_t lane = 0; lane < 3; ++lane) {
    const auto& beams = scratch.local_beams[lane];
    if (beams.empty()) continue;
    scratch.turned_sums.fill(0.0f);
    add_rows_(beams.data(), beams.size(), weight_, kernel.reach, scratch.turned_sums.data());
    // Turned back: the axes lane, lane + 1, lane + 2 stand at strides 1, 8, 64 of the turned sums.
    constexpr std::size_t kStride[] = {1, kBlockEdge, kBlockEdge * kBlockEdge};
    const std::size_t x = kStride[(3 - lane) % 3], y = kStride[(4 - lane) % 3], z = kStride[(5 - lane) % 3];
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      const std::size_t turned = (v % 8) * x + (v / 8 % 8) * y + (v / 64) * z;
      scratch.sums[v] += kernel.scale * scratch.turned_sums[turned];
    }
  }
}

void BeamEvidence::addTo(const BlockIndex& index, Block& block, EvidenceScratch& scratch) const {
  const VoxelKernel& kernel = field_->kernel();
  float* sums = scratch.sums.data();
  scratch.sums.fill(0.0f);
  if (kernel.type == KernelType::kCounting) {
    field_->forEachVoxelNear(index, 0.0, scratch,
                             [&](int offset, float rho, float) { sums[offset] += weightAt(weight_, rho); });
  } else {
    addLines(index, scratch);
  }
  const bool any = std::any_of(scratch.sums.begin(), scratch.sums.end(), [](float s) { return s > 0.0f; });
  if (any) block.add(kFreeClass, scratch.sums.data());
}

}  // namespace bki_mapping
