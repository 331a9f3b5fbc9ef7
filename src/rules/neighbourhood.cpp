#include "rules/neighbourhood.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "bki_mapping/core/grid_table.h"
#include "map/voxel_mask.h"
#include "rules/latest_looks.h"

namespace bki_mapping {
namespace {

/// Votes of a block with its surroundings, as far as the reach of a neighbourhood.
class Votes {
 public:
  explicit Votes(int reach) : reach_(reach), edge_(kBlockEdge + 2 * reach) {
    std::fill_n(votes_.begin(), edge_ * edge_ * edge_, 0);
  }
  int edge() const { return edge_; }
  /// The row along x of the voxel (0, y, z), counted from the corner of the surroundings.
  std::int32_t* row(int y, int z) { return votes_.data() + edge_ * (y + edge_ * z); }
  const std::int32_t* row(int y, int z) const { return votes_.data() + edge_ * (y + edge_ * z); }

  /// Copies what reaches into the surroundings of the votes of the block that lies (x, y, z) blocks beside
  /// the one in the middle.
  void copy(const std::array<EvidenceUnits, kBlockVoxels>& from, int x, int y, int z) {
    const Part along_x(x, reach_), along_y(y, reach_), along_z(z, reach_);
    for (int k = 0; k < along_z.count; ++k) {
      for (int j = 0; j < along_y.count; ++j) {
        const int voxel = along_x.from + kBlockEdge * (along_y.from + j + kBlockEdge * (along_z.from + k));
        std::copy_n(from.data() + voxel, along_x.count, row(along_y.to + j, along_z.to + k) + along_x.to);
      }
    }
  }
  /// The layers along z of a block that lies z blocks beside the one in the middle which copy() takes.
  Block::Layers layersOf(int z) const {
    const Part part(z, reach_);
    return {part.from, part.from + part.count};
  }

 private:
  /// The part of an axis that a block covers which lies `step` beside the one in the middle.
  struct Part {
    Part(int step, int reach)
        : to(step < 0   ? 0
             : step > 0 ? reach + kBlockEdge
                        : reach),
          from(step < 0 ? kBlockEdge - reach : 0),
          count(step == 0 ? kBlockEdge : reach) {}
    int to, from, count;  ///< in the surroundings, in the block
  };
  static constexpr int kMostEdge = kBlockEdge + 2 * StateRules::kMostReach;

  int reach_, edge_;
  std::array<std::int32_t, static_cast<std::size_t>(kMostEdge* kMostEdge* kMostEdge)> votes_;
};

/// Sums over a window that slides along rows of values. @param values of `kInner` windows of `window` rows
/// each, `stride` apart, the first at `values`. @param count length of a row. @param[out] sums rows of
/// `count`, one after another.
void slideWindow(const std::int32_t* values, int stride, int window, int count, std::int32_t* sums) {
  std::copy_n(values, count, sums);
  for (int n = 1; n < window; ++n) {
    for (int v = 0; v < count; ++v) sums[v] += values[n * stride + v];
  }
  for (int row = 1; row < kBlockEdge; ++row) {
    const std::int32_t* const leaves = values + (row - 1) * stride;
    const std::int32_t* const enters = leaves + window * stride;
    for (int v = 0; v < count; ++v)
      sums[row * count + v] = sums[(row - 1) * count + v] + enters[v] - leaves[v];
  }
}

/// Sums over the window of each voxel of the block, one axis after the other. @param has_below whether
/// windows include the layers below a voxel.
void sumWindows(const Votes& votes, int reach, bool has_below,
                std::array<EvidenceUnits, kBlockVoxels>& sums) {
  constexpr int kMostWindow = 2 * StateRules::kMostReach + 1,
                kMostEdge = kBlockEdge + 2 * StateRules::kMostReach;
  static_assert(std::int64_t{StateRules::kMostVote} * kMostWindow * kMostWindow * kMostWindow <= kMostUnits,
                "sums do not overflow");
  const int edge = votes.edge(), window = 2 * reach + 1;
  std::array<std::int32_t, static_cast<std::size_t>(kBlockEdge * kBlockEdge * kMostEdge)> layers;
  std::array<std::int32_t, static_cast<std::size_t>(kBlockEdge * kMostEdge)> rows;
  for (int z = 0; z < edge; ++z) {
    slideWindow(votes.row(0, z), edge, window, edge, rows.data());  // along y
    for (int y = 0; y < kBlockEdge; ++y) {
      const std::int32_t* const row = rows.data() + edge * y;
      std::int32_t* const sum = layers.data() + kBlockEdge * (y + kBlockEdge * z);
      sum[0] = std::accumulate(row, row + window, 0);
      for (int x = 1; x < kBlockEdge; ++x) sum[x] = sum[x - 1] + row[x + window - 1] - row[x - 1];
    }
  }
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  const int skipped = has_below ? 0 : reach;
  slideWindow(layers.data() + skipped * kLayer, kLayer, window - skipped, kLayer, sums.data());
}

/// Voxels of a block, by the box around them.
struct Extent {
  std::array<int, 3> least, most;

  /// Whether neighbourhoods of such a reach reach into the block that lies `step` beside along an axis.
  bool reaches(std::size_t axis, int step, int reach) const {
    return step == 0 || (step < 0 ? least[axis] < reach : most[axis] + reach >= kBlockEdge);
  }
  void include(std::size_t offset) {
    const int at[] = {static_cast<int>(offset) % kBlockEdge,
                      static_cast<int>(offset) / kBlockEdge % kBlockEdge,
                      static_cast<int>(offset) / (kBlockEdge * kBlockEdge)};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      least[axis] = std::min(least[axis], at[axis]);
      most[axis] = std::max(most[axis], at[axis]);
    }
  }
  /// Those for which isIn(offset).
  template <typename IsIn>
  static Extent of(const IsIn& isIn) {
    Extent extent{{kBlockEdge, kBlockEdge, kBlockEdge}, {-1, -1, -1}};
    for (std::size_t v = 0; v < kBlockVoxels; ++v) {
      if (isIn(v)) extent.include(v);
    }
    return extent;
  }
  bool isEmpty() const { return most[0] < 0; }
};

/// Visits the votes of the blocks beside one that may ask: visit(block, votes, x, y, z), with where it lies.
/// @param of the voxels whose neighbourhoods are needed. @param around says which layers are needed.
template <typename Visit>
void forEachBeside(const StateKernels& kernels, const SemanticMap& map, const StateRules& rules,
                   const BlockIndex& index, const Extent& of, const Votes& around, const Visit& visit) {
  const int reach = rules.neighbourhoodReach();
  BlockVotes votes{};  // only some layers are set
  for (int z = rules.neighbourhoodIsBelow() ? -1 : 0; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) {
        if ((x == 0 && y == 0 && z == 0) || !of.reaches(0, x, reach) || !of.reaches(1, y, reach) ||
            !of.reaches(2, z, reach))
          continue;
        const Block* const beside = map.find({{index.x + x, index.y + y, index.z + z}});
        if (beside && mayAskNeighbourhood(rules, *beside) &&
            kernels.votes(planesOf(map, rules, *beside), around.layersOf(z), votes))
          visit(*beside, votes, x, y, z);
      }
    }
  }
}

/// Finds what the voxels around clear or restore (12b). @param own votes of the block.
void decideTogether(const StateKernels& kernels, const SemanticMap& map, const StateRules& rules,
                    const BlockIndex& index, const Block& block, const BlockVotes& own,
                    Overruled& overruled) {
  const Extent asking = Extent::of([&](std::size_t v) { return own.kept[v] > 0 || own.doubtful[v] > 0; });
  if (asking.isEmpty()) return;
  const int reach = rules.neighbourhoodReach();
  Votes kept(reach), cleared(reach), keeping(reach);
  const auto take = [&](const Block&, const BlockVotes& votes, int x, int y, int z) {
    kept.copy(votes.kept, x, y, z);
    cleared.copy(votes.cleared, x, y, z);
    keeping.copy(votes.is_kept, x, y, z);
  };
  take(block, own, 0, 0, 0);
  forEachBeside(kernels, map, rules, index, asking, kept, take);
  std::array<EvidenceUnits, kBlockVoxels> kept_sums, cleared_sums, keeping_sums;
  sumWindows(kept, reach, rules.neighbourhoodIsBelow(), kept_sums);
  sumWindows(cleared, reach, rules.neighbourhoodIsBelow(), cleared_sums);
  sumWindows(keeping, reach, rules.neighbourhoodIsBelow(), keeping_sums);
  for (std::size_t v = 0; v < overruled.size(); ++v) {
    const VoteSums sums{kept_sums[v], cleared_sums[v], keeping_sums[v]};
    if (own.kept[v] > 0 && !areKept(rules, sums)) overruled[v] = kCleared;
    if (own.doubtful[v] > 0 && isRestored(rules, own.doubtful[v], sums)) overruled[v] = kKept;
  }
}

/// Lets looks decide before the sum. What is hidden votes only where it was hit for long.
void voteByLooks(const StateRules& rules, const Block& block, BlockVotes& votes) {
  if (block.looks().empty()) return;
  const Fates fates = fatesOf(block.looks());
  const auto keep = [&](std::size_t v) {
    votes.kept[v] += votes.cleared[v];
    votes.cleared[v] = 0;
  };
  forEachVoxelOf(fates.here, keep);
  forEachVoxelOf(fates.left, [&](std::size_t v) {
    votes.cleared[v] += votes.kept[v];
    votes.kept[v] = 0;
  });
  forEachVoxelOf(fates.hidden, [&](std::size_t v) {
    if (votes.kept[v] == 0 && votes.cleared[v] == 0) return;
    if (likeliestClass(block, v).second >= rules.hiddenVotesFrom()) return keep(v);
    votes.kept[v] = votes.cleared[v] = 0;
  });
}

/// Finds what is still there of what its own evidence clears. @param unsure hidden and grazed voxels.
void keepUnsure(const StateKernels& kernels, const SemanticMap& map, const StateRules& rules,
                const BlockIndex& index, const Block& block, const Look::Voxels& unsure,
                const BlockVotes& own, Overruled& overruled) {
  const auto asks = [&](std::size_t v) { return unsure[v] && own.cleared[v] > 0; };
  const Extent asking = Extent::of(asks);
  if (asking.isEmpty()) return;
  const int reach = rules.neighbourhoodReach();
  Votes here(reach), left(reach);
  const auto take = [&](const Block& from, BlockVotes& votes, int x, int y, int z) {
    voteByLooks(rules, from, votes);
    here.copy(votes.kept, x, y, z);
    left.copy(votes.cleared, x, y, z);
  };
  BlockVotes votes = own;
  take(block, votes, 0, 0, 0);
  forEachBeside(kernels, map, rules, index, asking, here, take);
  std::array<EvidenceUnits, kBlockVoxels> here_sums, left_sums;
  sumWindows(here, reach, true, here_sums);
  sumWindows(left, reach, true, left_sums);
  for (std::size_t v = 0; v < overruled.size(); ++v) {
    if (asks(v) && isStillThere(rules, {here_sums[v], left_sums[v]})) overruled[v] = kKept;
  }
}

}  // namespace

bool mayAskNeighbourhood(const StateRules& rules, const Block& block) {
  const auto& classes = block.classes();
  return rules.neighbourhoodRatio() > 0.0f &&
         std::any_of(classes.begin(), classes.end(), [&](ClassId id) { return rules.asksNeighbourhood(id); });
}

bool findOverruled(const StateKernels& kernels, const SemanticMap& map, const StateRules& rules,
                   const BlockIndex& index, const Block& block, const Look::Voxels& unsure,
                   Overruled& overruled) {
  if (!mayAskNeighbourhood(rules, block)) return false;
  BlockVotes own;
  if (!kernels.votes(planesOf(map, rules, block), {}, own)) return false;
  overruled.fill(kNotOverruled);
  decideTogether(kernels, map, rules, index, block, own, overruled);
  if (rules.hiddenAsk() && unsure.any())
    keepUnsure(kernels, map, rules, index, block, unsure, own, overruled);
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
