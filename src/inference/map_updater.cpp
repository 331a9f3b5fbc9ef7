#include "bki_mapping/inference/map_updater.h"

#include <stdexcept>

#include "bki_mapping/core/stopwatch.h"
#include "bki_mapping/inference/parallel_for.h"

namespace bki_mapping {
namespace {

struct Job {
  BlockIndex index;
  Block* block;
  std::uint32_t pieces;  ///< bit e: evidence e touches the block
};

std::vector<Job> collectJobs(SemanticMap& map, const std::vector<const Evidence*>& evidence) {
  IndexNumbering numbering;
  std::vector<Job> jobs;
  for (std::size_t e = 0; e < evidence.size(); ++e) {
    IndexNumbering touched;
    evidence[e]->collectBlocks(map, touched);
    for (const GridIndex& member : touched.members()) {
      const std::uint32_t number = numbering.insert(member);
      if (number == jobs.size()) jobs.push_back({{member}, &map.getOrAllocate({member}), 0});
      jobs[number].pieces |= 1u << e;
    }
  }
  return jobs;
}

}  // namespace

MapUpdateStats updateMap(SemanticMap& map, const std::vector<const Evidence*>& evidence, int threads) {
  if (evidence.size() > 32) throw std::invalid_argument("updateMap takes at most 32 pieces of evidence");
  MapUpdateStats stats;
  Stopwatch watch;
  const std::vector<Job> jobs = collectJobs(map, evidence);
  stats.blocks = jobs.size();
  stats.collect_ms = watch.lap();

  const int workers = threadCount(threads);
  std::vector<EvidenceScratch> scratch(static_cast<std::size_t>(workers));
  parallelFor(jobs.size(), workers, [&](std::size_t j, std::size_t worker) {
    for (std::size_t e = 0; e < evidence.size(); ++e) {
      if (jobs[j].pieces >> e & 1u) evidence[e]->addTo(jobs[j].index, *jobs[j].block, scratch[worker]);
    }
  });
  for (const Job& job : jobs) {
    if (job.block->empty()) map.erase(job.index);
  }
  stats.update_ms = watch.lap();
  return stats;
}

}  // namespace bki_mapping
