#include "update/map_updater.h"

#include <algorithm>
#include <atomic>

#include "core/stopwatch.h"
#include "parallel/chunks.h"

namespace bki_mapping {
namespace {

/// How far ahead what a block points to is prefetched [jobs], and twice as far the block: long enough to hide
/// the latency of memory.
constexpr std::size_t kAhead = 6;

}  // namespace

void MapUpdater::setTasks(const ScanEvidence& scan) {
  tasks_.resize(3);
  task_count_ = 0;
  for (Evidence* evidence : {scan.hits, scan.free}) {
    if (!evidence) continue;
    tasks_[task_count_].kind = evidence == scan.hits ? SumSink::Kind::kHits : SumSink::Kind::kFree;
    if (evidence == scan.free) evidence->limitTo(rules_.enoughFree());
    tasks_[task_count_].evidence = evidence;
    tasks_[task_count_++].work = evidence;
  }
  if (!scan.occlusion) return;
  tasks_[task_count_].evidence = nullptr;
  tasks_[task_count_].pass = scan.occlusion;
  tasks_[task_count_++].work = scan.occlusion;
}

std::uint32_t MapUpdater::jobOf(SemanticMap& map, const BlockIndex& index) {
  const std::uint32_t position = by_group_.insert(index);
  if (position < jobs_.size()) return position;
  touched_.push_back(index);
  const SemanticMap::Claim claimed = map.claim(index);
  try {
    jobs_.push_back({index, claimed.block, nullptr, 0, claimed.is_new, claimed.shared, 0, false, 0});
  } catch (...) {
    if (claimed.is_new) map.erase(index);
    throw;
  }
  return position;
}

void MapUpdater::collect(SemanticMap& map, const UpdateLimits& limits, ThreadPool& pool) {
  for (std::size_t t = 0; t < task_count_; ++t) {
    const std::vector<GridIndex>& blocks = tasks_[t].work->touchedBlocks(map, limits.blocks, pool);
    std::vector<std::uint32_t>& positions = tasks_[t].positions;
    positions.assign(jobs_.size(), kNoPosition);
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      const std::uint32_t job = jobOf(map, {blocks[b]});
      if (job == positions.size()) positions.push_back(kNoPosition);
      positions[job] = static_cast<std::uint32_t>(b);
    }
  }
  groupJobs(pool);
}

void MapUpdater::groupJobs(ThreadPool& pool) {
  by_group_.sort();
  sorted_.resize(jobs_.size());
  const Chunks chunks(jobs_.size());
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    for (std::size_t j = chunks.begin(c); j < chunks.end(c); ++j) {
      const std::uint32_t number = by_group_.numbers()[j];
      sorted_[j] = std::move(jobs_[number]);
      sorted_[j].number = number;
    }
  });
  jobs_.swap(sorted_);
  groups_.clear();
  for (std::size_t n = 0; n < by_group_.groups().size(); ++n) {
    Group group = {{by_group_.groups().members()[n], by_group_.slots(n)}, n, 0.0};
    for (std::size_t t = 0; t < task_count_; ++t) group.cost += tasks_[t].work->cost(group.blocks);
    groups_.push_back(group);
  }
  std::sort(groups_.begin(), groups_.end(), [](const Group& a, const Group& b) {
    return a.cost != b.cost ? a.cost > b.cost : a.position < b.position;
  });
}

template <typename Prefetch, typename Visit>
void MapUpdater::forEachJob(ThreadPool& pool, const Prefetch& prefetch, const Visit& visit) {
  const Chunks chunks(jobs_.size());
  pool.forEach(chunks.count(), [&](std::size_t c, std::size_t worker) {
    const std::size_t end = chunks.end(c);
    for (std::size_t j = chunks.begin(c); j < end; ++j) {
      if (end - j > 2 * kAhead) jobs_[j + 2 * kAhead].block->prefetchHead();
      if (end - j > kAhead) prefetch(j + kAhead);
      visit(j, worker);
    }
  });
}

std::size_t MapUpdater::reservePlanes(BlockJob& job) {
  ClassSet classes;
  for (std::size_t t = 0; t < task_count_; ++t) {
    const std::uint32_t touched = tasks_[t].positionOf(job.number);
    if (touched != kNoPosition && tasks_[t].evidence) tasks_[t].evidence->markClasses(touched, classes);
  }
  const std::size_t count = classes.count();
  job.bytes_before = job.is_new ? 0 : job.block->bytes();
  for (const ClassId known : job.block->classes()) classes.reset(known);
  if (job.is_shared) {
    job.copy = std::make_shared<Block>(*job.block, classes.count());
    job.block = job.copy.get();
  } else {
    job.block->reserve(classes.count());
  }
  if (keeps_looks_) job.block->looks().reserveTick(tick_);
  return count;
}

std::size_t MapUpdater::reserveBlocks(const UpdateLimits& limits, std::ptrdiff_t index_bytes,
                                      ThreadPool& pool) {
  std::atomic<std::ptrdiff_t> bytes{index_bytes};
  std::atomic<std::size_t> most_classes{0};
  const auto most = static_cast<std::ptrdiff_t>(
      std::min<std::size_t>(limits.bytes, std::numeric_limits<std::ptrdiff_t>::max()));
  const auto prefetch = [&](std::size_t j) { jobs_[j].block->looks().prefetch(); };
  forEachJob(pool, prefetch, [&](std::size_t j, std::size_t) {
    BlockJob& job = jobs_[j];
    const std::size_t classes = reservePlanes(job);
    for (std::size_t known = most_classes; known < classes;) {
      if (most_classes.compare_exchange_weak(known, classes)) break;
    }
    const auto of_job = static_cast<std::ptrdiff_t>(job.block->bytes() - job.bytes_before);
    if (of_job == 0) return;
    const std::ptrdiff_t sum = bytes += of_job;
    if (sum > most) throw TooMuchWork(TooMuchWork::What::kBytes, static_cast<double>(sum));
  });
  return most_classes;
}

void MapUpdater::reserveSeams() {
  const auto isBottom = [](const BlockJob& job) { return slotInGroup(job.index) < kSlotsOfLayer; };
  seams_.assign(jobs_.size(), {});
  seam_sums_.resize(static_cast<std::size_t>(std::count_if(jobs_.begin(), jobs_.end(), isBottom)));
  auto sums = seam_sums_.begin();
  for (std::size_t j = 0; j < jobs_.size(); ++j) {
    if (isBottom(jobs_[j])) seams_[j].sums = (sums++)->data();
  }
}

void MapUpdater::reserve(const UpdateLimits& limits, std::ptrdiff_t index_bytes, ThreadPool& pool) {
  for (std::size_t t = 0; t < task_count_; ++t) tasks_[t].work->reserve(pool.count());
  const std::size_t most_classes = reserveBlocks(limits, index_bytes, pool);
  workers_.resize(pool.count());
  for (Worker& worker : workers_) {
    worker.sums.reserve(rules_, most_classes, withdraws_);
    worker.blocks.reserve(kGroupBlocks);
    worker.mended = {};
  }
  if (rules_.asksBelow()) reserveSeams();
  if (rules_.seeksVoids()) voids_.start(jobs_.size(), rules_.thin_reach, rules_.void_margin);
}

void MapUpdater::useCopies(SemanticMap& map) noexcept {
  for (BlockJob& job : jobs_) {
    if (job.copy) map.replace(job.index, std::move(job.copy));
  }
}

void MapUpdater::rollBack(SemanticMap& map) noexcept {
  for (const BlockJob& job : jobs_) {
    if (!job.is_shared) job.block->shrink();
    if (job.is_new) map.erase(job.index);
  }
  jobs_.clear();
  touched_.clear();
}

BlockGroup MapUpdater::selectBlocks(const Task& task, const Group& group, Worker& to) {
  BlockGroup selected = {group.blocks.index, 0};
  to.blocks.clear();
  for (std::size_t j = by_group_.begin(group.position); j != by_group_.end(group.position); ++j) {
    const BlockJob& job = jobs_[j];
    const std::uint32_t touched = task.positionOf(job.number);
    if (touched == kNoPosition) continue;
    job.block->prefetchHead();
    selected.blocks |= std::uint64_t{1} << slotInGroup(job.index);
    to.blocks.emplace_back(job.index, touched, job.block, rules_.seeksVoids() ? &voids_.at(j) : nullptr,
                           rules_.asksBelow() ? &seams_[j] : nullptr);
  }
  return selected;
}

void MapUpdater::addGroup(const Group& group, std::size_t worker) {
  Worker& own = workers_[worker];
  GroupInWork in_work(own.sums);
  if (rules_.seeksVoids()) {
    for (std::size_t j = by_group_.begin(group.position); j != by_group_.end(group.position); ++j) {
      voids_.at(j) = {};
    }
  }
  for (std::size_t t = 0; t < task_count_; ++t) {
    const Task& task = tasks_[t];
    const BlockGroup selected = selectBlocks(task, group, own);
    if (own.blocks.empty()) continue;
    if (task.evidence) {
      SumSink sink(in_work, task.kind, own.blocks);
      task.evidence->accumulate(selected, own.blocks, worker, sink);
    } else {
      for (const GroupBlock& block : own.blocks) task.pass->apply(block, worker, *block.block_);
    }
  }
}

void MapUpdater::add(ThreadPool& pool) {
  const auto add_group = [&](std::size_t g, std::size_t worker) {
    addGroup(groups_[g], worker);
    if (mends()) return;
    const std::size_t position = groups_[g].position;
    for (std::size_t j = by_group_.begin(position); j != by_group_.end(position); ++j) finish(jobs_[j]);
  };
  if (!groups_.empty() && groups_.front().cost > 0.0) {
    pool.forEachInOrder(groups_.size(), add_group);
  } else {
    pool.forEach(groups_.size(), add_group);
  }
}

void MapUpdater::mend(ThreadPool& pool) {
  if (rules_.seeksVoids()) voids_.find(by_group_, pool);
  if (rules_.asksBelow()) {
    pool.forEach(groups_.size(), [&](std::size_t g, std::size_t worker) { mendSeams(groups_[g], worker); });
  }
  const EvidenceUnits of_void = roundedUnits(rules_.void_evidence);
  EvidenceUnits of_layer[kBlockEdge * kBlockEdge];
  std::fill(std::begin(of_layer), std::end(of_layer), of_void);
  const auto prefetch = [&](std::size_t j) {
    if (of_void > 0 && voids_.voidsOf(j).any()) jobs_[j].block->prefetch();
    if (keeps_looks_) jobs_[j].block->looks().prefetch();
  };
  forEachJob(pool, prefetch, [&](std::size_t j, std::size_t worker) {
    if (of_void > 0) addVoids(j, of_layer, worker);
    if (keeps_looks_) addLooks(j, of_void > 0);
    finish(jobs_[j]);
  });
}

void MapUpdater::mendSeams(const Group& group, std::size_t worker) {
  const auto add = withdraws_ ? kernels_.withdraw_units : kernels_.add_units;
  const GridIndex& index = group.blocks.index;
  const std::uint32_t group_below = by_group_.groups().find({index.x, index.y, index.z - 1});
  if (group_below == kNoPosition) return;
  for (int slot = 0; slot < kSlotsOfLayer; ++slot) {
    const std::uint32_t job = by_group_.at(group.position, slot);
    if (job == kNoPosition || seams_[job].held_back == 0) continue;
    const std::uint32_t below = by_group_.at(group_below, slot + kGroupBlocks - kSlotsOfLayer);
    const std::uint64_t voxels = below == kNoPosition ? 0 : seams_[job].held_back & seams_[below].reached_top;
    if (voxels == 0) continue;
    EvidenceUnits units[kBlockEdge * kBlockEdge] = {};
    for (std::uint64_t left = voxels; left != 0; left &= left - 1) {
      const int v = __builtin_ctzll(left);
      units[v] = heldBack(rules_, seams_[job].sums[v]);
      if (keeps_looks_ && units[v] > 0) voids_.at(job).adds = true;
    }
    jobs_[job].block->change(kFreeClass, [&](EvidenceUnits* plane) {
      return add(&voxels, 1, units, plane, workers_[worker].mended);
    });
  }
}

void MapUpdater::addVoids(std::size_t job, const EvidenceUnits* units, std::size_t worker) {
  const VoxelMask& voids = voids_.voidsOf(job);
  if (voids.none()) return;
  const auto add = withdraws_ ? kernels_.withdraw_units : kernels_.add_units;
  const LayerBits layers = bitsOf(voids);
  jobs_[job].block->change(kFreeClass, [&](EvidenceUnits* plane) {
    return add(layers.data(), kBlockEdge, units, plane, workers_[worker].mended);
  });
}

void MapUpdater::addLooks(std::size_t job, bool voids_add) noexcept {
  const SeenVoxels& seen = voids_.at(job);
  // A block exists where scans add evidence: whether others have done so must make no difference to this one.
  if (!seen.adds && !(voids_add && voids_.voidsOf(job).any())) return;
  jobs_[job].block->looks().add(Look(tick_, voids_.emptyOf(job), voids_.voidsOf(job), seen.hit));
}

void MapUpdater::finish(BlockJob& job) {
  if (withdraws_) job.block->shrink();
  job.empty = job.block->empty();
  const std::size_t after = job.empty ? 0 : job.block->bytes();
  job.bytes = static_cast<std::ptrdiff_t>(after) - static_cast<std::ptrdiff_t>(job.bytes_before);
}

MapUpdateStats MapUpdater::update(SemanticMap& map, const ScanEvidence& scan, ThreadPool& pool,
                                  const ScanRules& rules, const UpdateLimits& limits) {
  MapUpdateStats stats;
  Stopwatch watch;
  touched_.clear();
  by_group_.clear();
  jobs_.clear();
  rules_ = rules;
  withdraws_ = scan.withdraws;
  keeps_looks_ = rules.keeps_looks && scan.stamp > 0 && !scan.withdraws;
  tick_ = Look::tickOf(scan.stamp);
  const auto indexBytes = [&] { return static_cast<std::ptrdiff_t>(map.indexBytes()); };
  const std::ptrdiff_t index_before = indexBytes();
  try {
    setTasks(scan);
    collect(map, limits, pool);
    reserve(limits, indexBytes() - index_before, pool);
  } catch (...) {
    rollBack(map);
    throw;
  }
  stats.blocks = jobs_.size();
  stats.collect_ms = watch.lap();

  // From here on nothing allocates memory, so that nothing can fail.
  useCopies(map);
  add(pool);
  if (mends()) mend(pool);
  for (const BlockJob& job : jobs_) {
    stats.bytes += job.bytes;
    if (job.empty) map.erase(job.index);
  }
  for (Worker& worker : workers_) stats.sums += worker.mended += worker.sums.counts();
  stats.update_ms = watch.lap();
  return stats;
}

}  // namespace bki_mapping
