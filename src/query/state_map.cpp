#include "bki_mapping/query/state_map.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>

#include "parallel/thread_pool.h"
#include "rules/neighbourhood.h"

namespace bki_mapping {
namespace {

static_assert(static_cast<int>(VoxelState::kFree) == 1 && static_cast<int>(VoxelState::kOccupied) == 2 &&
                  static_cast<int>(VoxelState::kOccluded) == 3,
              "two bits tell the states");

/// Gathers the lowest bits of eight bytes.
std::uint64_t lowestBits(std::uint64_t bytes) {
  // Each bit is multiplied to the place in the top byte that is its byte's number.
  return ((bytes & 0x0101010101010101u) * 0x0102040810204080u) >> 56;
}

void decide(const SemanticMap& map, const StateRules& rules, const BlockIndex& index, const Block& block,
            BlockStates& states) {
  BlockView view;
  readBlock(map, rules, index, block, BlockFields::kStates, view);
  states.asks_neighbourhood = mayAskNeighbourhood(rules, block);
  states.labels = view.label;
  states.block = &block;
  std::uint64_t any_occupied = 0, any_free = 0, all_free = ~std::uint64_t{0};
  for (std::size_t z = 0; z < kBlockEdge; ++z) {
    BlockStates::Layer& layer = states.layers[z];
    for (std::size_t y = 0; y < kBlockEdge; ++y) {
      std::uint64_t row;  // eight states
      std::memcpy(&row, view.state.data() + kBlockEdge * (kBlockEdge * z + y), sizeof(row));
      const std::uint64_t low = lowestBits(row), high = lowestBits(row >> 1), shift = kBlockEdge * y;
      layer.occupied |= (high & ~low) << shift;
      layer.free |= (low & ~high) << shift;
      states.occluded[z] |= (low & high) << shift;
    }
    any_occupied |= layer.occupied;
    any_free |= layer.free;
    all_free &= layer.free;
  }
  states.any_occupied = any_occupied != 0;
  states.any_free = any_free != 0;
  states.all_free = all_free == ~std::uint64_t{0};
}

/// Whether two maps have the same at all 26 neighbours of an index.
/// @param across_faces only at those six that share a face with it.
template <typename Find, typename FindEarlier>
bool sameAround(const GridIndex& index, bool across_faces, const Find& find,
                const FindEarlier& find_earlier) {
  for (int n = 0; n < 27; ++n) {
    const int x = n % 3 - 1, y = n / 3 % 3 - 1, z = n / 9 - 1;
    const int apart = std::abs(x) + std::abs(y) + std::abs(z);
    if (apart == 0 || (across_faces && apart > 1)) continue;
    const GridIndex at{index.x + x, index.y + y, index.z + z};
    if (find(at) != find_earlier(at)) return false;
  }
  return true;
}

}  // namespace

StateMap::RegionStates::RegionStates(const Region& region, const SemanticMap& map,
                                     const RegionStates& earlier, const SemanticMap& earlier_map)
    : region_(&region) {
  std::array<int, Region::kBlocks> numbers;
  std::array<std::uintptr_t, Region::kBlocks> slots;
  std::size_t count = 0;
  for (int number = 0; number < Region::kBlocks; ++number) {
    if (!region.has(number)) continue;
    const std::uintptr_t known =
        earlier.blocks_[static_cast<std::size_t>(number)].load(std::memory_order_acquire);
    const BlockStates* const states = glanceOf(known).block;
    if (!states) continue;
    __builtin_prefetch(&states->block, 1);
    numbers[count] = number;
    slots[count++] = known;
  }
  for (std::size_t n = 0; n < count; ++n) {
    const BlockStates& states = *glanceOf(slots[n]).block;
    if (states.block != region.find(numbers[n])) continue;
    if (states.asks_neighbourhood &&
        !sameAround(
            region.blockIndex(numbers[n]), false, [&](const GridIndex& at) { return map.find({at}); },
            [&](const GridIndex& at) { return earlier_map.find({at}); })) {
      continue;
    }
    states.owners.share();
    blocks_[static_cast<std::size_t>(numbers[n])].store(slots[n], std::memory_order_relaxed);
  }
}

StateMap::RegionStates::~RegionStates() {
  for (const auto& slot : blocks_) {
    const BlockStates* const states = glanceOf(slot.load(std::memory_order_relaxed)).block;
    if (states && states->owners.release()) delete states;
  }
}

std::uintptr_t StateMap::RegionStates::read(const StateMap& map, const BlockIndex& index) const {
  const Block* const block = region_->find(Region::numberOf(index));
  if (!block) {
    slot(index).store(kAbsent, std::memory_order_release);
    return kAbsent;
  }
  auto states = std::make_unique<BlockStates>();
  decide(map.map(), map.rules(), index, *block, *states);
  const std::uintptr_t decided = reinterpret_cast<std::uintptr_t>(states.get()) |
                                 (states->any_occupied ? kAnyOccupied : 0) |
                                 (states->all_free ? kAllFree : 0);
  std::uintptr_t known = kNotRead;
  if (!slot(index).compare_exchange_strong(known, decided, std::memory_order_acq_rel)) return known;
  states.release();
  return decided;
}

void StateMap::RegionStates::readAll(const StateMap& map) const {
  std::array<int, Region::kBlocks> numbers;
  std::array<const Block*, Region::kBlocks> blocks;
  std::size_t count = 0;
  for (int number = 0; number < Region::kBlocks; ++number) {
    const auto& slot = blocks_[static_cast<std::size_t>(number)];
    if (!region_->has(number) || slot.load(std::memory_order_relaxed) != kNotRead) continue;
    numbers[count] = number;
    blocks[count++] = region_->find(number);
  }
  for (std::size_t n = 0; n < count; ++n) {
    // The first leads to what the second needs.
    if (n + 4 < count) __builtin_prefetch(blocks[n + 4]);
    if (n + 2 < count) blocks[n + 2]->prefetch<false>();
    read(map, region_->blockIndex(numbers[n]));
  }
}

StateMap::Known::~Known() {
  const RegionStates* const known = states.load(std::memory_order_relaxed);
  if (known && known->owners_.release()) delete known;
}

StateMap::StateMap(const SemanticMap& map, const StateRules& rules, int threads)
    : map_(map), rules_(rules), threads_(threads), regions_(map.regionCount()) {
  constexpr int kMostThreads = 1024;
  if (threads < 0 || threads > kMostThreads) {
    throw std::invalid_argument("the number of threads of a StateMap is " + std::to_string(threads) +
                                "; give 0 (all cores) to " + std::to_string(kMostThreads));
  }
  const std::vector<GridIndex> regions = map.regions();
  if (regions.empty()) return;
  GridIndex low = regions.front(), high = low;
  for (const GridIndex& region : regions) {
    low = {std::min(low.x, region.x), std::min(low.y, region.y), std::min(low.z, region.z)};
    high = {std::max(high.x, region.x), std::max(high.y, region.y), std::max(high.z, region.z)};
  }
  constexpr std::int32_t kEdge = Region::kEdge;
  bounds_.min = {low.x * kEdge, low.y * kEdge, low.z * kEdge};
  bounds_.max = {high.x * kEdge + kEdge - 1, high.y * kEdge + kEdge - 1, high.z * kEdge + kEdge - 1};
}

StateMap::StateMap(const SemanticMap& map, const StateRules& rules, const StateMap& earlier, int threads)
    : StateMap(map, rules, threads) {
  if (rules.decidesAs(earlier.rules_)) takeOver(earlier);
}

void StateMap::takeOver(const StateMap& earlier) {
  // Both maps exist, and hold their blocks: a block that both have at the same address is the same object.
  // Neither map changes, and a map copies blocks that it shares before it writes to them.
  const bool alone = !(rules_.neighbourhoodRatio() > 0.0f);  // states depend on nothing outside of the block
  const auto surroundings_are_same = [&](const GridIndex& region) {
    return sameAround(
        region, alone, [&](const GridIndex& at) { return map_.findRegion(at); },
        [&](const GridIndex& at) { return earlier.map_.findRegion(at); });
  };
  for (std::uint32_t position = 0; position < regions_.size(); ++position) {
    const Region& region = map_.regionAt(position);
    const std::uint32_t before = earlier.map_.positionOf(region.index());
    if (before == kNoPosition) continue;
    Known& known = regions_[position];
    RegionStates* const states = earlier.regions_[before].states.load(std::memory_order_acquire);
    if (!states) continue;
    if (states->region_ != &region || !(alone || surroundings_are_same(region.index()))) {
      known.states.store(new RegionStates(region, map_, *states, earlier.map_), std::memory_order_relaxed);
      continue;
    }
    states->owners_.share();
    known.states.store(states, std::memory_order_relaxed);
    auto kept = earlier.keptFrontiers(before);
    if (!kept) continue;
    if (!alone || surroundings_are_same(region.index())) known.frontiers = std::move(kept);
  }
}

StateMap::~StateMap() = default;

const StateMap::RegionStates* StateMap::region(const GridIndex& region) const {
  const std::uint32_t position = map_.positionOf(region);
  if (position == kNoPosition) return nullptr;
  std::atomic<RegionStates*>& slot = regions_[position].states;
  RegionStates* known = slot.load(std::memory_order_acquire);
  if (known) return known;
  auto states = std::make_unique<RegionStates>(map_.regionAt(position));
  if (!slot.compare_exchange_strong(known, states.get(), std::memory_order_acq_rel)) return known;
  return states.release();
}

const BlockStates* StateMap::find(const BlockIndex& index) const {
  const RegionStates* const in = region(SemanticMap::regionOf(index));
  return in ? in->find(*this, index) : nullptr;
}

VoxelState StateMap::state(const VoxelIndex& voxel) const {
  const BlockStates* const states = find(GridGeometry::blockOf(voxel));
  return states ? states->state(GridGeometry::offsetInBlock(voxel)) : VoxelState::kUnknown;
}

ClassId StateMap::label(const VoxelIndex& voxel) const {
  const BlockStates* const states = find(GridGeometry::blockOf(voxel));
  return states ? states->labels[static_cast<std::size_t>(GridGeometry::offsetInBlock(voxel))] : kFreeClass;
}

void StateMap::parallelFor(std::size_t jobs, const std::function<void(std::size_t)>& job) const {
  if (jobs <= 1 || threads_ == 1) {
    for (std::size_t j = 0; j < jobs; ++j) job(j);
    return;
  }
  const std::lock_guard<std::mutex> lock(pool_mutex_);
  if (!pool_) pool_ = std::make_unique<ThreadPool>(threads_);
  pool_->forEach(jobs, [&](std::size_t j, std::size_t) { job(j); });
}

}  // namespace bki_mapping
