#include "points/point_evidence.h"

#include <algorithm>
#include <cmath>

namespace bki_mapping {
namespace {

bool isZero(float x) {
  return x == 0.0f;
}

}  // namespace

PointEvidence::PointEvidence(const GridGeometry& geometry, const KernelConfig& kernel,
                             const std::string& instruction_set)
    : kernel_(kernel, geometry.resolution()),
      loops_(innerLoopsFor(instruction_set)),
      bins_(geometry, kernel_, loops_) {}

void PointEvidence::setPoints(const Eigen::Vector3d& origin, const Downsampler& points, ThreadPool& pool) {
  size_ = points.size();
  bins_.setPoints(origin, points, protect_, pool);
}

const std::vector<GridIndex>& PointEvidence::collectBlocks(const SemanticMap&, std::size_t most,
                                                           ThreadPool&) {
  limitBlocks(bins_.blocks().size(), most);
  return bins_.blocks().members();
}

void PointEvidence::markClasses(std::size_t number, ClassSet& classes) const {
  if (bins_.oneClass()) {
    classes.set(bins_.begin(number)->points->label);
    return;
  }
  std::uint64_t bits = 0;
  for (const PointRun* run = bins_.begin(number); run != bins_.end(number); ++run) bits |= run->classes;
  constexpr std::uint64_t kShared = std::uint64_t{1} << PointRun::kSharedBit;
  for (std::uint64_t left = bits & ~kShared; left != 0; left &= left - 1) {
    classes.set(static_cast<std::size_t>(__builtin_ctzll(left)));
  }
  if ((bits & kShared) == 0) return;
  for (const PointRun* run = bins_.begin(number); run != bins_.end(number); ++run) {
    for (std::size_t i = 0; i < run->count; ++i) classes.set(run->points[i].label);
  }
}

void PointEvidence::reserve(EvidenceScratch& scratch) const {
  std::size_t most = scratch.points.size();
  for (std::size_t block = 0; block < bins_.blocks().size() && !bins_.oneClass(); ++block) {
    std::size_t count = 0;
    for (const PointRun* run = bins_.begin(block); run != bins_.end(block); ++run) count += run->count;
    most = std::max(most, count);
  }
  scratch.points.resize(most);
}

Block::Layers PointEvidence::sumPoints(const PointRun* runs, std::size_t count,
                                       EvidenceScratch& scratch) const {
  if (kernel_.type == KernelType::kSparse) {
    return loops_.sum_points(runs, count, kernel_.reach, kernel_.scale, scratch.sums.data());
  }
  scratch.sums.fill(0.0f);
  for (const PointRun* run = runs; run != runs + count; ++run) {
    for (std::size_t i = 0; i < run->count; ++i) scratch.sums[run->points[i].voxel] += 1.0f;
  }
  return {};
}

std::size_t PointEvidence::sortByClass(std::size_t block, EvidenceScratch& scratch, ClassEnds& end) const {
  end.fill(0);
  std::size_t count = 0, last = 0;
  for (const PointRun* run = bins_.begin(block); run != bins_.end(block); ++run) {
    count += run->count;
    for (std::size_t i = 0; i < run->count; ++i) {
      const std::size_t label = run->points[i].label;
      ++end[label + 1];
      last = std::max(last, label);
    }
  }
  // A counting sort; most blocks see two or three classes.
  for (std::size_t label = 1; label <= last; ++label) end[label] += end[label - 1];
  for (const PointRun* run = bins_.begin(block); run != bins_.end(block); ++run) {
    for (std::size_t i = 0; i < run->count; ++i) {
      scratch.points[end[run->points[i].label]++] = run->points[i];
    }
  }
  return count;
}

void PointEvidence::addClass(ClassId label, const PointRun* runs, std::size_t count, bool limited,
                             Block& block, EvidenceScratch& scratch) const {
  const Block::Layers layers = sumPoints(runs, count, scratch);
  if (protect_evidence_) scratch.holdSums();
  if (label == kFreeClass) {
    scratch.leaveHeldAlone();
    scratch.limitFree();
  } else if (limited) {
    scratch.limitHits();
  }
  const bool nothing = protect_ && std::all_of(scratch.sums.begin(), scratch.sums.end(), isZero);
  if (!nothing) scratch.not_finite += block.add(label, scratch.sums.data(), layers);
}

void PointEvidence::prefetch(std::size_t number) const {
  constexpr std::size_t kPointsALine = 64 / sizeof(LocalPoint), kMostLines = 16;
  for (const PointRun* run = bins_.begin(number); run != bins_.end(number); ++run) {
    const std::size_t end = std::min(run->count, kMostLines * kPointsALine);
    for (std::size_t i = 0; i < end; i += kPointsALine) __builtin_prefetch(run->points + i);
  }
}

void PointEvidence::addTo(std::size_t number, const BlockIndex&, Block& block,
                          EvidenceScratch& scratch) const {
  const PointRun* const runs = bins_.begin(number);
  const auto run_count = static_cast<std::size_t>(bins_.end(number) - runs);
  for (const PointRun* run = runs; protect_ && run != runs + run_count; ++run) {
    for (std::size_t i = 0; i < run->count; ++i) {
      if (run->points[i].voxel != LocalPoint::kOutside) scratch.held.set(run->points[i].voxel);
    }
  }
  const auto first_class = static_cast<ClassId>(runs->points->label);
  const bool limited = std::isfinite(scratch.limits.hits) && first_class != kFreeClass;
  if (limited) {
    sumPoints(runs, run_count, scratch);
    scratch.shareHits();
  }
  if (bins_.oneClass()) {
    addClass(first_class, runs, run_count, limited, block, scratch);
    return;
  }
  ClassEnds end;
  const std::size_t count = sortByClass(number, scratch, end);
  for (std::size_t i = 0; i < count;) {
    const auto label = static_cast<ClassId>(scratch.points[i].label);
    const PointRun run{scratch.points.data() + i, end[label] - i, 0};
    addClass(label, &run, 1, limited, block, scratch);
    i = end[label];
  }
}

}  // namespace bki_mapping
