#include "bki_mapping/inference/map_updater.h"

#include <stdexcept>

#include "bki_mapping/core/stopwatch.h"

namespace bki_mapping {
namespace {

/// Blocks that a thread takes at a time.
constexpr std::size_t kBlocksAJob = 4;

}  // namespace

void MapUpdater::collectJobs(SemanticMap& map, const std::vector<Evidence*>& evidence, Workers& workers) {
  numbering_.clear();
  jobs_.clear();
  for (std::size_t e = 0; e < evidence.size(); ++e) {
    touched_.clear();
    evidence[e]->collectBlocks(map, workers, touched_);
    for (const GridIndex& member : touched_.members()) {
      const std::uint32_t number = numbering_.insert(member);
      if (number == jobs_.size()) {
        const std::size_t size = map.size();
        Block& block = map.getOrAllocate({member});
        jobs_.push_back({{member}, &block, 0, map.size() > size ? 0 : block.bytes()});
      }
      jobs_[number].pieces |= 1u << e;
    }
  }
}

MapUpdateStats MapUpdater::update(SemanticMap& map, const std::vector<Evidence*>& evidence,
                                  Workers& workers) {
  if (evidence.size() > 32) throw std::invalid_argument("a scan has at most 32 pieces of evidence");
  MapUpdateStats stats;
  Stopwatch watch;
  collectJobs(map, evidence, workers);
  stats.blocks = jobs_.size();
  stats.collect_ms = watch.lap();

  scratch_.resize(workers.count());
  for (EvidenceScratch& scratch : scratch_) scratch.limits = limits_;
  workers.forEach((jobs_.size() + kBlocksAJob - 1) / kBlocksAJob, [&](std::size_t j, std::size_t worker) {
    const std::size_t end = std::min(jobs_.size(), (j + 1) * kBlocksAJob);
    for (std::size_t n = j * kBlocksAJob; n < end; ++n) {
      const Job& job = jobs_[n];
      scratch_[worker].held.reset();
      for (std::size_t e = 0; e < evidence.size(); ++e) {
        if (job.pieces >> e & 1u) evidence[e]->addTo(job.index, *job.block, scratch_[worker]);
      }
    }
  });
  for (const Job& job : jobs_) {
    const bool keep = !job.block->empty();
    stats.bytes +=
        static_cast<std::ptrdiff_t>(keep ? job.block->bytes() : 0) - static_cast<std::ptrdiff_t>(job.bytes);
    if (!keep) map.erase(job.index);
  }
  stats.update_ms = watch.lap();
  return stats;
}

}  // namespace bki_mapping
