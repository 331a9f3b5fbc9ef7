#include "bki_mapping/query/queries.h"

#include <algorithm>
#include <utility>

#include "query/region_frontiers.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kRegionsPerJob = 8;

/// The frontiers of a region, which are kept for the next call. @param position its position in the map.
std::shared_ptr<const RegionFrontiers> ofWholeRegion(const StateMap& states, std::uint32_t position) {
  if (auto kept = states.keptFrontiers(position)) return kept;
  auto made = std::make_shared<const RegionFrontiers>(states, states.map().regionAt(position), nullptr);
  states.keepFrontiers(position, made);
  return made;
}

/// Clusters the frontier voxels of all regions: those of each region, which are kept for the next call, and
/// of these what is connected across regions.
class FrontierFinder {
 public:
  FrontierFinder(const StateMap& states, const FrontierRules& rules)
      : states_(states), with_voxels_(rules.with_voxels), min_size_(rules.min_size) {
    if (rules.box) box_.emplace(states.geometry(), *rules.box);
    regions_.resize(states.map().regionCount());
    first_part_.resize(regions_.size());
    states.parallelFor((regions_.size() + kRegionsPerJob - 1) / kRegionsPerJob, [&](std::size_t job) {
      const std::size_t end = std::min(regions_.size(), (job + 1) * kRegionsPerJob);
      for (std::size_t r = job * kRegionsPerJob; r < end; ++r) regions_[r] = inRegion(r);
    });
    for (std::size_t r = 0; r < regions_.size(); ++r) {
      first_part_[r] = static_cast<std::uint32_t>(parts_.size());
      if (!regions_[r]) continue;
      for (std::size_t part = 0; part < regions_[r]->parts().size(); ++part) parts_.add();
    }
    for (std::size_t r = 0; r < regions_.size(); ++r) joinWithOthers(r);
  }

  std::vector<Frontier> clusters() {
    std::vector<VoxelSum> sums(parts_.size());
    forEachPart([&](std::uint32_t part, const VoxelSum& sum) { sums[parts_.rootOf(part)].add(sum); });
    std::vector<std::uint32_t> found;  // the roots
    for (std::uint32_t part = 0; part < sums.size(); ++part) {
      if (sums[part].count > 0 && sums[part].count >= min_size_) found.push_back(part);
    }
    std::sort(found.begin(), found.end(), [&](std::uint32_t a, std::uint32_t b) {
      if (sums[a].count != sums[b].count) return sums[a].count > sums[b].count;
      return sums[a].first < sums[b].first;
    });
    std::vector<Frontier> frontiers(found.size());
    for (std::size_t f = 0; f < found.size(); ++f) {
      const VoxelSum& sum = sums[found[f]];
      frontiers[f].size = sum.count;
      for (Eigen::Index axis = 0; axis < 3; ++axis) {
        const auto total = static_cast<double>(sum.sum[static_cast<std::size_t>(axis)]);
        frontiers[f].centre[axis] =
            (total / static_cast<double>(sum.count) + 0.5) * states_.geometry().resolution();
      }
    }
    if (with_voxels_) listVoxels(found, frontiers);
    return frontiers;
  }

 private:
  using Piece = RegionFrontiers::Piece;

  /// The frontiers of a region, or nullptr if it is outside the box. @param r its position in the map.
  std::shared_ptr<const RegionFrontiers> inRegion(std::size_t r) const {
    const Region& region = states_.map().regionAt(static_cast<std::uint32_t>(r));
    if (box_ && !box_->overlapsRegion(region.index())) return nullptr;
    if (box_ && !box_->containsRegion(region.index())) {
      return std::make_shared<const RegionFrontiers>(states_, region, &*box_);
    }
    return ofWholeRegion(states_, static_cast<std::uint32_t>(r));
  }

  /// Joins the parts of a region with those of regions around it.
  void joinWithOthers(std::size_t r) {
    if (!regions_[r]) return;
    const GridIndex own = states_.map().regionAt(static_cast<std::uint32_t>(r)).index();
    for (const Piece& piece : regions_[r]->pieces()) {
      if (!isAtBorder(piece.block)) continue;
      forEachNextBlock(piece.voxels, [&](int dx, int dy, int dz, const BlockLayers& there) {
        const BlockIndex next = {{piece.block.x + dx, piece.block.y + dy, piece.block.z + dz}};
        const GridIndex region = SemanticMap::regionOf(next);
        if (region == own) return;
        const std::uint32_t other = states_.map().positionOf(region);
        if (other == kNoPosition || !regions_[other]) return;
        regions_[other]->forEachPieceOf(Region::numberOf(next), [&](const Piece& beside) {
          if (overlap(there, beside.voxels)) {
            parts_.join(first_part_[r] + piece.part, first_part_[other] + beside.part);
          }
        });
      });
    }
  }

  static bool isAtBorder(const BlockIndex& block) {
    constexpr auto kLast = static_cast<unsigned>(Region::kEdge - 1);
    const auto at_border = [](std::int32_t index) {
      const unsigned in_region = static_cast<unsigned>(index) & kLast;
      return in_region == 0 || in_region == kLast;
    };
    return at_border(block.x) || at_border(block.y) || at_border(block.z);
  }

  /// Calls visit(part, what is known of it).
  template <typename Visit>
  void forEachPart(Visit&& visit) const {
    for (std::size_t r = 0; r < regions_.size(); ++r) {
      if (!regions_[r]) continue;
      std::uint32_t part = first_part_[r];
      for (const VoxelSum& sum : regions_[r]->parts()) visit(part++, sum);
    }
  }

  /// @param found the roots of the clusters' parts.
  void listVoxels(const std::vector<std::uint32_t>& found, std::vector<Frontier>& frontiers) {
    std::vector<std::uint32_t> frontier_of(parts_.size(), kNoPosition);
    for (std::size_t f = 0; f < found.size(); ++f) frontier_of[found[f]] = static_cast<std::uint32_t>(f);
    std::vector<std::vector<const Piece*>> pieces(frontiers.size());
    for (std::size_t r = 0; r < regions_.size(); ++r) {
      if (!regions_[r]) continue;
      for (const Piece& piece : regions_[r]->pieces()) {
        const std::uint32_t f = frontier_of[parts_.rootOf(first_part_[r] + piece.part)];
        if (f != kNoPosition) pieces[f].push_back(&piece);
      }
    }
    states_.parallelFor(frontiers.size(), [&](std::size_t f) {
      frontiers[f].voxels.reserve(frontiers[f].size);
      appendVoxels(pieces[f], frontiers[f].voxels);
    });
  }

  /// Appends the voxels of pieces in the order of GridIndex.
  static void appendVoxels(std::vector<const Piece*>& pieces, std::vector<VoxelIndex>& voxels) {
    std::sort(pieces.begin(), pieces.end(),
              [](const Piece* a, const Piece* b) { return a->block < b->block; });
    struct Part {
      BlockIndex block;
      BlockLayers voxels;
    };
    std::vector<Part> blocks;  // may have several pieces of the cluster
    blocks.reserve(pieces.size());
    for (const Piece* piece : pieces) {
      if (blocks.empty() || blocks.back().block != piece->block) blocks.push_back({piece->block, {}});
      for (std::size_t z = 0; z < kBlockEdge; ++z) blocks.back().voxels[z] |= piece->voxels[z];
    }
    const auto differs = [&](std::size_t n, auto coordinate) {
      return n == blocks.size() || blocks[n].block.*coordinate != blocks[n - 1].block.*coordinate;
    };
    const auto appendRow = [&](const Part& part, std::size_t y, std::size_t z) {
      for (std::uint64_t row = part.voxels[z] >> kBlockEdge * y & kFirstRow; row != 0; row &= row - 1) {
        const auto offset = static_cast<int>(64 * z + kBlockEdge * y) + __builtin_ctzll(row);
        voxels.push_back(GridGeometry::voxelOf(part.block, offset));
      }
    };
    for (std::size_t slab = 0, next_slab = 0; slab < blocks.size(); slab = next_slab) {
      while (!differs(++next_slab, &BlockIndex::z)) {
      }
      for (std::size_t z = 0; z < kBlockEdge; ++z) {
        for (std::size_t row = slab, next_row = slab; row < next_slab; row = next_row) {
          while (++next_row < next_slab && !differs(next_row, &BlockIndex::y)) {
          }
          for (std::size_t y = 0; y < kBlockEdge; ++y) {
            for (std::size_t n = row; n < next_row; ++n) appendRow(blocks[n], y, z);
          }
        }
      }
    }
  }

  const StateMap& states_;
  bool with_voxels_;
  std::size_t min_size_;
  std::optional<VoxelBox> box_;
  // By the position of the region in the map:
  std::vector<std::shared_ptr<const RegionFrontiers>> regions_;  ///< nullptr: outside the box
  std::vector<std::uint32_t> first_part_;                        ///< of the region in parts_
  Groups parts_;                                                 ///< of all regions
};

}  // namespace

std::vector<Frontier> frontiers(const StateMap& states, const FrontierRules& rules) {
  return FrontierFinder(states, rules).clusters();
}

void prepareFrontiers(const StateMap& states, const std::function<bool()>& goes_on) {
  for (std::size_t position = states.map().regionCount(); position-- > 0 && goes_on();) {
    ofWholeRegion(states, static_cast<std::uint32_t>(position));
  }
}

std::vector<Frontier> frontiers(const StateMap& states, std::size_t min_size) {
  return frontiers(states, FrontierRules{min_size, true, std::nullopt});
}

}  // namespace bki_mapping
