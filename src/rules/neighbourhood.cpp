#include "rules/neighbourhood.h"

#include <algorithm>
#include <array>

#include "bki_mapping/core/grid_table.h"

namespace bki_mapping {
namespace {

constexpr int kReach = kNeighbourhoodReach, kWindow = 2 * kReach + 1, kEdge = kBlockEdge + 2 * kReach;

/// A block with its surroundings.
using Votes = std::array<std::array<std::array<std::int32_t, kEdge>, kEdge>, kEdge>;

/// The part of an axis that a block covers which lies `step` beside the one in the middle.
struct Part {
  explicit Part(int step)
      : to(step < 0   ? 0
           : step > 0 ? kReach + kBlockEdge
                      : kReach),
        from(step < 0 ? kBlockEdge - kReach : 0),
        count(step == 0 ? kBlockEdge : kReach) {}
  int to, from, count;  ///< in Votes, in the block
};

void copyPart(const std::array<EvidenceUnits, kBlockVoxels>& from, const Part& x, const Part& y,
              const Part& z, Votes& to) {
  const auto at = [](int n) { return static_cast<std::size_t>(n); };
  for (int k = 0; k < z.count; ++k) {
    for (int j = 0; j < y.count; ++j) {
      const int voxel = x.from + kBlockEdge * (y.from + j + kBlockEdge * (z.from + k));
      std::copy_n(from.data() + voxel, x.count, to[at(z.to + k)][at(y.to + j)].data() + x.to);
    }
  }
}

/// Sums over the window of each voxel of the block, one axis after the other. @param first_layer of the
/// window, along z.
void sumWindows(const Votes& votes, std::size_t first_layer, std::array<EvidenceUnits, kBlockVoxels>& sums) {
  static_assert(std::int64_t{StateRules::kMostVote} * kWindow * kWindow * kWindow <= kMostUnits,
                "sums do not overflow");
  static_assert(kWindow == 5, "as many terms");
  constexpr std::size_t kInner = kBlockEdge, kRows = kEdge;
  std::array<std::array<std::array<std::int32_t, kInner>, kRows>, kRows> along_x;
  std::array<std::array<std::array<std::int32_t, kInner>, kInner>, kRows> along_y{};
  for (std::size_t z = 0; z < kRows; ++z) {
    for (std::size_t y = 0; y < kRows; ++y) {
      for (std::size_t x = 0; x < kInner; ++x) {
        const std::int32_t* const row = votes[z][y].data() + x;
        along_x[z][y][x] = row[0] + row[1] + row[2] + row[3] + row[4];
      }
    }
    for (std::size_t y = 0; y < kInner; ++y) {
      for (std::size_t n = 0; n < kWindow; ++n) {
        for (std::size_t x = 0; x < kInner; ++x) along_y[z][y][x] += along_x[z][y + n][x];
      }
    }
  }
  sums.fill(0);
  for (std::size_t z = 0; z < kInner; ++z) {
    for (std::size_t n = first_layer; n < kWindow; ++n) {
      const std::int32_t* const layer = along_y[z + n][0].data();
      for (std::size_t v = 0; v < kInner * kInner; ++v) sums[kInner * kInner * z + v] += layer[v];
    }
  }
}

}  // namespace

bool mayAskNeighbourhood(const StateRules& rules, const Block& block) {
  const auto& classes = block.classes();
  return rules.neighbourhoodRatio() > 0.0f &&
         std::any_of(classes.begin(), classes.end(), [&](ClassId id) { return rules.asksNeighbourhood(id); });
}

bool findOverruled(const ViewKernels& kernels, const SemanticMap& map, const StateRules& rules,
                   const BlockIndex& index, const Block& block, Overruled& overruled) {
  if (!mayAskNeighbourhood(rules, block)) return false;
  BlockVotes own;
  if (!kernels.votes(planesOf(map, rules, block), {}, own)) return false;
  Votes kept{}, cleared{}, keeping{};
  BlockVotes beside;
  for (int z = rules.neighbourhoodIsBelow() ? -1 : 0; z <= 1; ++z) {
    const Part layers(z);
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        const BlockVotes* votes = &own;
        if (x != 0 || y != 0 || z != 0) {
          const Block* const neighbour = map.find({{index.x + x, index.y + y, index.z + z}});
          if (!neighbour || !mayAskNeighbourhood(rules, *neighbour) ||
              !kernels.votes(planesOf(map, rules, *neighbour), {layers.from, layers.from + layers.count},
                             beside))
            continue;
          votes = &beside;
        }
        copyPart(votes->kept, Part(x), Part(y), layers, kept);
        copyPart(votes->cleared, Part(x), Part(y), layers, cleared);
        copyPart(votes->is_kept, Part(x), Part(y), layers, keeping);
      }
    }
  }
  std::array<EvidenceUnits, kBlockVoxels> kept_sums, cleared_sums, keeping_sums;
  const std::size_t first_layer = rules.neighbourhoodIsBelow() ? 0 : kReach;
  sumWindows(kept, first_layer, kept_sums);
  sumWindows(cleared, first_layer, cleared_sums);
  sumWindows(keeping, first_layer, keeping_sums);
  for (std::size_t v = 0; v < overruled.size(); ++v) {
    const VoteSums sums{kept_sums[v], cleared_sums[v], keeping_sums[v]};
    overruled[v] = kNotOverruled;
    if (own.kept[v] > 0 && !areKept(rules, sums)) overruled[v] = kCleared;
    if (own.doubtful[v] > 0 && isRestored(rules, own.doubtful[v], sums)) overruled[v] = kKept;
  }
  return true;
}

std::vector<GridIndex> withDependents(const SemanticMap& map, const StateRules& rules,
                                      Span<const GridIndex> blocks) {
  std::vector<GridIndex> all;
  GridTable known;
  const auto insert = [&](const GridIndex& index) {
    const auto fresh = static_cast<std::uint32_t>(all.size());
    if (known.insert(index, fresh) == fresh) all.push_back(index);
  };
  for (const GridIndex& index : blocks) insert(index);
  if (!(rules.neighbourhoodRatio() > 0.0f)) return all;
  for (const GridIndex& index : blocks) {
    // Where no voxel asks those below, nothing depends on what is below it.
    for (int n = 0; n < (rules.neighbourhoodIsBelow() ? 27 : 18); ++n) {
      const GridIndex beside{index.x + n % 3 - 1, index.y + n / 3 % 3 - 1, index.z + n / 9 - 1};
      if (known.find(beside) != kNoPosition) continue;
      const Block* const block = map.find({beside});
      if (block && mayAskNeighbourhood(rules, *block)) insert(beside);
    }
  }
  return all;
}

}  // namespace bki_mapping
