#include "bki_mapping/inference/map_updater.h"

#include <algorithm>

#include "bki_mapping/core/stopwatch.h"

namespace bki_mapping {
namespace {

/// Blocks that a thread takes at a time.
constexpr std::size_t kBlocksAJob = 4;

}  // namespace

void MapUpdater::collectJobs(SemanticMap& map, const std::vector<Evidence*>& evidence, Workers& workers) {
  numbering_.clear();
  jobs_.clear();
  if (number_of_.size() < evidence.size()) number_of_.resize(evidence.size());
  for (std::size_t e = 0; e < evidence.size(); ++e) {
    const std::vector<GridIndex>& touched = evidence[e]->collectBlocks(map, workers);
    std::vector<std::uint32_t>& number_of = number_of_[e];
    number_of.assign(jobs_.size(), kNone);
    for (std::size_t number = 0; number < touched.size(); ++number) {
      const std::uint32_t job = numbering_.insert(touched[number]);
      if (job == jobs_.size()) {
        const std::size_t size = map.size();
        Block& block = map.getOrAllocate({touched[number]});
        jobs_.push_back({{touched[number]}, &block, map.size() > size, false, 0});
        number_of.push_back(kNone);
      }
      number_of[job] = static_cast<std::uint32_t>(number);
    }
  }
}

void MapUpdater::work(const std::vector<Evidence*>& evidence, std::size_t number, EvidenceScratch& scratch) {
  Job& job = jobs_[number];
  const std::size_t before = job.is_new ? 0 : job.block->bytes();
  scratch.held.reset();
  for (std::size_t e = 0; e < evidence.size(); ++e) {
    if (number >= number_of_[e].size() || number_of_[e][number] == kNone) continue;
    evidence[e]->addTo(number_of_[e][number], job.index, *job.block, scratch);
  }
  job.empty = job.block->empty();
  const std::size_t after = job.empty ? 0 : job.block->bytes();
  job.bytes = static_cast<std::ptrdiff_t>(after) - static_cast<std::ptrdiff_t>(before);
}

MapUpdateStats MapUpdater::update(SemanticMap& map, const std::vector<Evidence*>& evidence,
                                  Workers& workers) {
  MapUpdateStats stats;
  Stopwatch watch;
  collectJobs(map, evidence, workers);
  stats.blocks = jobs_.size();
  stats.collect_ms = watch.lap();

  scratch_.resize(workers.count());
  for (EvidenceScratch& scratch : scratch_) {
    scratch.limits = limits_;
    for (const EvidenceScratch& other : scratch_) scratch.reserveAs(other);
  }
  workers.forEach((jobs_.size() + kBlocksAJob - 1) / kBlocksAJob, [&](std::size_t j, std::size_t worker) {
    const std::size_t end = std::min(jobs_.size(), (j + 1) * kBlocksAJob);
    for (std::size_t n = j * kBlocksAJob; n < end; ++n) work(evidence, n, scratch_[worker]);
  });
  for (const Job& job : jobs_) {
    stats.bytes += job.bytes;
    if (job.empty) map.erase(job.index);
  }
  stats.update_ms = watch.lap();
  return stats;
}

}  // namespace bki_mapping
