#include "update/map_updater.h"

#include <algorithm>
#include <atomic>

#include "core/stopwatch.h"

namespace bki_mapping {

std::uint32_t MapUpdater::jobOf(SemanticMap& map, const BlockIndex& index) {
  const std::size_t size = map.size();
  SemanticMap::Entry& entry = map.entry(index);
  // What an earlier update wrote there is the number of no job now, or of another block's.
  if (entry.job < jobs_.size() && jobs_[entry.job].index == index) return entry.job;
  entry.job = static_cast<std::uint32_t>(jobs_.size());
  const bool is_new = map.size() > size;
  try {
    touched_.push_back(index);
    jobs_.push_back({index, entry.block.get(), is_new, 0, false, 0});
  } catch (...) {
    if (is_new) map.erase(index);
    throw;
  }
  return entry.job;
}

void MapUpdater::collectJobs(SemanticMap& map, const std::vector<Evidence*>& evidence,
                             const UpdateLimits& limits, ThreadPool& pool) {
  if (number_of_.size() < evidence.size()) number_of_.resize(evidence.size());
  for (std::size_t e = 0; e < evidence.size(); ++e) {
    const std::vector<GridIndex>& blocks = evidence[e]->collectBlocks(map, limits.blocks, pool);
    std::vector<std::uint32_t>& number_of = number_of_[e];
    number_of.assign(jobs_.size(), kNone);
    for (std::size_t number = 0; number < blocks.size(); ++number) {
      const std::uint32_t job = jobOf(map, {blocks[number]});
      if (job == number_of.size()) number_of.push_back(kNone);
      number_of[job] = static_cast<std::uint32_t>(number);
    }
  }
}

std::uint32_t MapUpdater::numberIn(std::size_t evidence, std::size_t job) const {
  return job < number_of_[evidence].size() ? number_of_[evidence][job] : kNone;
}

void MapUpdater::prefetch(const std::vector<Evidence*>& evidence, std::size_t number) const {
  jobs_[number].block->prefetch();
  for (std::size_t e = 0; e < evidence.size(); ++e) {
    if (numberIn(e, number) != kNone) evidence[e]->prefetch(numberIn(e, number));
  }
}

void MapUpdater::work(const std::vector<Evidence*>& evidence, std::size_t number, EvidenceScratch& scratch) {
  Job& job = jobs_[number];
  scratch.held.reset();
  for (std::size_t e = 0; e < evidence.size(); ++e) {
    const std::uint32_t number_there = numberIn(e, number);
    if (number_there != kNone) evidence[e]->addTo(number_there, job.index, *job.block, scratch);
  }
  job.empty = job.block->empty();
  const std::size_t after = job.empty ? 0 : job.block->bytes();
  job.bytes = static_cast<std::ptrdiff_t>(after) - static_cast<std::ptrdiff_t>(job.bytes_before);
}

void MapUpdater::groupJobs(const std::vector<Evidence*>& evidence) {
  group_jobs_.clear();
  for (std::size_t n = 0; n < jobs_.size(); ++n) {
    group_jobs_.add(groupOf(jobs_[n].index), static_cast<std::uint32_t>(n));
  }
  group_jobs_.sort();
  groups_.clear();
  for (std::size_t n = 0; n < group_jobs_.indices().size(); ++n) {
    Group each = {{group_jobs_.indices().members()[n]}, n, 0.0};
    for (const std::uint32_t* job = group_jobs_.begin(n); job != group_jobs_.end(n); ++job) {
      each.group.blocks |= std::uint64_t{1} << numberInGroup(jobs_[*job].index);
    }
    for (const Evidence* piece : evidence) each.effort += piece->effort(each.group);
    groups_.push_back(each);
  }
  std::sort(groups_.begin(), groups_.end(), [](const Group& a, const Group& b) {
    return a.effort != b.effort ? a.effort > b.effort : a.number < b.number;
  });
}

void MapUpdater::work(const std::vector<Evidence*>& evidence, const Group& group, EvidenceScratch& scratch) {
  for (const Evidence* piece : evidence) piece->enter(group.group, scratch);
  for (const std::uint32_t* job = group_jobs_.begin(group.number); job != group_jobs_.end(group.number);
       ++job) {
    if (job + 1 != group_jobs_.end(group.number)) prefetch(evidence, job[1]);
    work(evidence, *job, scratch);
  }
}

std::size_t MapUpdater::reservePlanes(const std::vector<Evidence*>& evidence, std::size_t number) {
  ClassSet classes;
  for (std::size_t e = 0; e < evidence.size(); ++e) {
    const std::uint32_t number_there = numberIn(e, number);
    if (number_there != kNone) evidence[e]->markClasses(number_there, classes);
  }
  Job& job = jobs_[number];
  Block& block = *job.block;
  const std::size_t bytes = block.bytes();
  job.bytes_before = job.is_new ? 0 : bytes;
  for (const ClassId known : block.classes()) classes.reset(known);
  block.reserve(classes.count());
  return block.bytes() - job.bytes_before;
}

void MapUpdater::reserve(const std::vector<Evidence*>& evidence, const UpdateLimits& limits,
                         std::ptrdiff_t index_bytes, ThreadPool& pool) {
  scratch_.resize(pool.count());
  for (EvidenceScratch& scratch : scratch_) {
    scratch.limits = limits.evidence;
    scratch.not_finite = 0;
    for (const Evidence* piece : evidence) piece->reserve(scratch);
  }
  std::atomic<std::ptrdiff_t> bytes{index_bytes};
  const auto most = static_cast<std::ptrdiff_t>(
      std::min<std::size_t>(limits.bytes, std::numeric_limits<std::ptrdiff_t>::max()));
  pool.forEach(groups_.size(), [&](std::size_t g, std::size_t) {
    std::ptrdiff_t of_group = 0;
    const std::size_t number = groups_[g].number;
    constexpr std::ptrdiff_t kAhead = 4;
    for (const std::uint32_t* job = group_jobs_.begin(number); job != group_jobs_.end(number); ++job) {
      if (group_jobs_.end(number) - job > kAhead) __builtin_prefetch(jobs_[job[kAhead]].block);
      of_group += static_cast<std::ptrdiff_t>(reservePlanes(evidence, *job));
    }
    const std::ptrdiff_t sum = bytes += of_group;
    if (sum > most) throw TooMuchWork(TooMuchWork::What::kBytes, static_cast<double>(sum));
  });
}

void MapUpdater::rollBack(SemanticMap& map) noexcept {
  for (const Job& job : jobs_) {
    job.block->shrink();
    if (job.is_new) map.erase(job.index);
  }
  jobs_.clear();
  touched_.clear();
}

MapUpdateStats MapUpdater::update(SemanticMap& map, const std::vector<Evidence*>& evidence, ThreadPool& pool,
                                  const UpdateLimits& limits) {
  MapUpdateStats stats;
  Stopwatch watch;
  touched_.clear();
  jobs_.clear();
  const auto indexBytes = [&] { return static_cast<std::ptrdiff_t>(map.indexBytes()); };
  const std::ptrdiff_t index_before = indexBytes();
  try {
    collectJobs(map, evidence, limits, pool);
    groupJobs(evidence);
    reserve(evidence, limits, indexBytes() - index_before, pool);
  } catch (...) {
    rollBack(map);
    throw;
  }
  stats.blocks = jobs_.size();
  stats.collect_ms = watch.lap();

  // From here on nothing takes memory, so that nothing can fail.
  const auto each = [&](std::size_t g, std::size_t worker) { work(evidence, groups_[g], scratch_[worker]); };
  if (!groups_.empty() && groups_.front().effort > 0.0) {
    pool.forEachInOrder(groups_.size(), each);
  } else {
    pool.forEach(groups_.size(), each);
  }
  for (const Job& job : jobs_) {
    stats.bytes += job.bytes;
    if (job.empty) map.erase(job.index);
  }
  for (const EvidenceScratch& scratch : scratch_) stats.not_finite += scratch.not_finite;
  stats.update_ms = watch.lap();
  return stats;
}

}  // namespace bki_mapping
