#include "bki_mapping/rules/voxel_state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "rules/latest_looks.h"
#include "rules/neighbourhood.h"
#include "rules/occupancy_constants.h"
#include "rules/state_kernels.h"

namespace bki_mapping {
namespace {

constexpr EvidenceUnits kNoEvidence[kBlockVoxels] = {};

/// - p log(p), accurate for p near 1, too. @param others sum of the other concentrations.
double entropyTerm(double alpha, double others) {
  return alpha / (alpha + others) * std::log1p(others / alpha);
}

/// What decides the state of a voxel by itself.
struct OwnEvidence {
  EvidenceUnits best = 0, free = 0;                ///< evidence of the likeliest class, and for `free`
  EvidenceUnits counted = 0;                       ///< of that for `free`, what counts for the state
  EvidenceUnits fixed_best = 0;                    ///< of the likeliest of the classes that cannot move
  ClassId label = kFreeClass, fixed = kFreeClass;  ///< these classes
  double of_classes = 0.0;                         ///< the sum over all classes [units]
  float gain = 1.0f;                               ///< of the likeliest class
  bool holds = false;                              ///< (11)
};

/// StateRules::mostFree, where the block has looks that can clear what it keeps.
EvidenceUnits mostFreeOf(const StateRules& rules, const Block& block) {
  return block.looks().empty() ? kMostUnits : rules.mostFree();
}

OwnEvidence ownEvidence(const StateRules& rules, const Block& block, int offset) {
  // Units are whole numbers, of which doubles hold the sum over all classes exactly.
  OwnEvidence own;
  const auto& classes = block.classes();
  for (std::size_t i = 0; i < classes.size(); ++i) {
    const EvidenceUnits units = std::max(block.plane(i)[offset], 0);
    if (classes[i] == kFreeClass) {
      own.free = units;
      continue;
    }
    own.of_classes += units;
    if (units > own.best) {  // of equal evidence, the first class has the smaller id
      own.best = units;
      own.label = classes[i];
    }
    if (units > own.fixed_best && rules.isFixed(classes[i])) {
      own.fixed_best = units;
      own.fixed = classes[i];
    }
  }
  own.gain = rules.freeGain(own.label, kEvidenceUnit * static_cast<float>(own.best));
  own.counted = std::min(own.free, mostFreeOf(rules, block));
  own.holds = isOccupied(own.best, own.gain, own.counted);
  return own;
}

/// Equation 12b: what the voxels around say of one that asks them. @param looks_first whether looks decide
/// before the sum, and what is hidden votes only where it was hit for long.
VoteSums votesAround(const SemanticMap& map, const StateRules& rules, const VoxelIndex& voxel,
                     bool looks_first) {
  const int reach = rules.neighbourhoodReach();
  const BlockIndex first = GridGeometry::blockOf({{voxel.x - reach, voxel.y - reach, voxel.z - reach}});
  static_assert(2 * StateRules::kMostReach < 2 * kBlockEdge,
                "they are in at most three blocks along each axis");
  constexpr int kAlong = 3;
  std::array<const Block*, kAlong * kAlong * kAlong> blocks;
  for (int n = 0; n < kAlong * kAlong * kAlong; ++n) {
    blocks[static_cast<std::size_t>(n)] =
        map.find({{first.x + n % kAlong, first.y + n / kAlong % kAlong, first.z + n / (kAlong * kAlong)}});
  }
  VoteSums sums;
  const EvidenceUnits most = rules.mostVote();
  for (int z = rules.neighbourhoodIsBelow() ? -reach : 0; z <= reach; ++z) {
    for (int y = -reach; y <= reach; ++y) {
      for (int x = -reach; x <= reach; ++x) {
        const VoxelIndex at{{voxel.x + x, voxel.y + y, voxel.z + z}};
        const BlockIndex index = GridGeometry::blockOf(at);
        const int n = index.x - first.x + kAlong * (index.y - first.y + kAlong * (index.z - first.z));
        const Block* const block = blocks[static_cast<std::size_t>(n)];
        if (!block) continue;
        const int offset = GridGeometry::offsetInBlock(at);
        OwnEvidence own = ownEvidence(rules, *block, offset);
        if (own.best == 0 || !rules.asksNeighbourhood(own.label)) continue;
        const Fate fate =
            looks_first ? fateOf(block->looks(), static_cast<std::size_t>(offset)) : Fate::kUnclear;
        if (fate == Fate::kHidden && own.best < rules.hiddenVotesFrom()) continue;
        if (fate == Fate::kHere || fate == Fate::kHidden) own.holds = true;
        if (fate == Fate::kLeft) own.holds = false;
        (own.holds ? sums.kept : sums.cleared) += std::min(own.best, most);
        sums.keeping += own.holds;
      }
    }
  }
  return sums;
}

/// Equation 13: the probability that something is in a voxel. @param best evidence of the likeliest class.
double occupancyOf(double prior, double best, double gain, double free) {
  const double weighted_free = kWeightOfFree * std::max(gain, 1.0) * free;
  const double something = kPriorOfSomething * prior + best + kInFreeSpace * weighted_free;
  const double nothing = kPriorOfNothing * prior + kBesideSurfaces * something + weighted_free;
  return something / (something + nothing);
}

/// Sum of (alpha_k / alpha)^2 over all classes k.
double squaredRatios(const SemanticMap& map, const Block& block, int offset, double alpha) {
  constexpr double kUnit = kEvidenceUnit;
  const auto square = [](double ratio) { return ratio * ratio; };
  double sum = static_cast<double>(map.classCount()) * square(map.prior() / alpha);
  for (std::size_t i = 0; i < block.classes().size(); ++i) {
    const double evidence = kUnit * std::max(block.plane(i)[offset], 0);
    if (block.classes()[i] == kFreeClass || evidence == 0.0) continue;
    sum += square((map.prior() + evidence) / alpha) - square(map.prior() / alpha);
  }
  return sum;
}

}  // namespace

bool isOccupied(EvidenceUnits best, float gain, EvidenceUnits free) {
  return best >= static_cast<double>(gain) * free;
}

BlockPlanes planesOf(const SemanticMap& map, const StateRules& rules, const Block& block) {
  BlockPlanes planes;
  planes.map = &map;
  planes.rules = &rules;
  planes.most_vote = rules.mostVote();
  planes.free = kNoEvidence;
  planes.most_free = mostFreeOf(rules, block);
  for (std::size_t p = 0; p < block.classes().size(); ++p) {
    const ClassId id = block.classes()[p];
    if (id == kFreeClass) {
      planes.free = block.plane(p);
      planes.has_free = true;
      continue;
    }
    const float gain = rules.freeGain(id, -1.0f);
    planes.planes[planes.count++] = {block.plane(p),
                                     id,
                                     gain,
                                     rules.standingGain(id),
                                     rules.standsAfter(id),
                                     rules.isFixed(id),
                                     rules.asksNeighbourhood(id)};
  }
  return planes;
}

void readBlock(const StateKernels& kernels, const SemanticMap& map, const StateRules& rules,
               const BlockIndex& index, const Block& block, BlockFields fields, BlockView& view) {
  const auto read = fields == BlockFields::kStates          ? kernels.states
                    : fields == BlockFields::kAllButEntropy ? kernels.posterior
                                                            : kernels.all;
  BlockPlanes planes = planesOf(map, rules, block);
  Overruled overruled;
  const bool looks_decide = rules.latestDecides() && !block.looks().empty();
  const Fates fates = looks_decide ? fatesOf(block.looks()) : Fates();
  bool overrules = findOverruled(kernels, map, rules, index, block, fates.hidden | fates.grazed, overruled);
  if (looks_decide) {
    if (!overrules) overruled.fill(kNotOverruled);
    overrules |= overruleByLooks(block, rules, fates, overruled);
  }
  if (overrules) planes.overruled = &overruled;
  read(planes, view);
  const Block::Occlusion& marks = block.occlusion();
  if (marks.none()) return;
  for (std::size_t v = 0; v < kBlockVoxels; ++v) {
    if (marks[v] && view.state[v] == VoxelState::kUnknown) view.state[v] = VoxelState::kOccluded;
  }
}

void readBlock(const SemanticMap& map, const StateRules& rules, const BlockIndex& index, const Block& block,
               BlockFields fields, BlockView& view) {
  static const StateKernels* const fastest = &stateKernelsFor("");
  readBlock(*fastest, map, rules, index, block, fields, view);
}

VoxelView viewWithoutEntropy(const SemanticMap& map, const StateRules& rules, const BlockIndex& index,
                             const Block& block, int offset) {
  OwnEvidence own = ownEvidence(rules, block, offset);
  bool holds = own.holds, restored = false, has_left = false;
  if (rules.neighbourhoodRatio() > 0.0f && own.best > 0 && rules.asksNeighbourhood(own.label)) {
    const VoxelIndex voxel = GridGeometry::voxelOf(index, offset);
    const VoteSums sums = votesAround(map, rules, voxel, false);
    const bool is_doubtful = std::int64_t{kFreeOfOneHit} * own.best >= own.free;
    holds = own.holds ? areKept(rules, sums)
                      : is_doubtful && isRestored(rules, std::min(own.best, rules.mostVote()), sums);
    if (!own.holds && !holds && rules.hiddenAsk()) {
      const Fate fate = fateOf(block.looks(), static_cast<std::size_t>(offset));
      if (fate == Fate::kHidden || fate == Fate::kGrazed)
        holds = isStillThere(rules, votesAround(map, rules, voxel, true));
    }
    restored = holds && !own.holds;
    has_left = !holds && own.holds;
  }
  if (rules.latestDecides() && own.best > 0) {
    const std::int32_t verdict = verdictOf(block.looks(), static_cast<std::size_t>(offset),
                                           stayOf(own.best, rules), rules.canLeave(own.label));
    if (verdict != kNotOverruled) {
      holds = verdict == kKept;
      restored = holds && !own.holds;
      has_left = !holds && own.holds;
    }
  }
  if (!holds && rules.remainingGain() > 0.0f && own.fixed != own.label &&
      own.fixed_best > (own.best - 1) >> kRemainingShift &&
      isOccupied(own.fixed_best, rules.remainingGain(), own.free)) {
    holds = true;
    has_left = false;
    own.best = own.fixed_best;
    own.label = own.fixed;
    own.gain = rules.remainingGain();
  }
  VoxelView view;
  if (own.best > 0 || own.free > 0) {
    view.state = holds ? VoxelState::kOccupied : VoxelState::kFree;
  } else if (block.occlusion()[static_cast<std::size_t>(offset)]) {
    view.state = VoxelState::kOccluded;
  }
  const bool occupied = view.state == VoxelState::kOccupied;
  if (occupied) view.label = own.label;

  // Equations 10 and 13.
  constexpr double kUnit = kEvidenceUnit;
  const double best = kUnit * own.best, free = kUnit * own.free, of_classes = kUnit * own.of_classes;
  const double prior = map.prior(), prior_of_classes = prior * static_cast<double>(map.classCount());
  const double decisive = occupied ? best : free, alpha = prior + decisive;
  const double others = prior_of_classes + (of_classes + free - decisive), sum = alpha + others;
  view.evidence = static_cast<float>(of_classes + free);
  view.probability = static_cast<float>(alpha / sum);
  view.variance = static_cast<float>(alpha / sum * (others / sum) / (sum + 1.0));
  view.occupancy = static_cast<float>(occupancyOf(prior, has_left ? 0.0 : best, static_cast<double>(own.gain),
                                                  restored ? 0.0 : kUnit * own.counted));
  view.class_probability = static_cast<float>(1.0 / squaredRatios(map, block, offset, prior + best));
  return view;
}

VoxelView viewVoxel(const SemanticMap& map, const StateRules& rules, const BlockIndex& index,
                    const Block& block, int offset) {
  VoxelView view = viewWithoutEntropy(map, rules, index, block, offset);
  const auto classes = block.classes().size(), all = map.classCount() + 1;
  double total = 0.0;
  for (std::size_t i = 0; i < classes; ++i) total += std::max(block.plane(i)[offset], 0);
  const auto term = [&](double units) {
    constexpr double kUnit = kEvidenceUnit;
    const double others = map.prior() * static_cast<double>(all - 1) + kUnit * (total - units);
    return entropyTerm(map.prior() + kUnit * units, others);
  };
  double entropy = static_cast<double>(all - classes) * term(0.0);
  for (std::size_t i = 0; i < classes; ++i) entropy += term(std::max(block.plane(i)[offset], 0));
  view.entropy = static_cast<float>(entropy);
  return view;
}

VoxelView viewWithoutEntropy(const SemanticMap& map, const StateRules& rules, const VoxelIndex& voxel) {
  const BlockIndex index = GridGeometry::blockOf(voxel);
  const Block* block = map.find(index);
  return block ? viewWithoutEntropy(map, rules, index, *block, GridGeometry::offsetInBlock(voxel))
               : VoxelView();
}

VoxelView viewPoint(const SemanticMap& map, const StateRules& rules, const Eigen::Vector3d& point) {
  const VoxelIndex voxel = map.geometry().voxelAt(point);
  const BlockIndex index = GridGeometry::blockOf(voxel);
  const Block* block = map.find(index);
  const int offset = GridGeometry::offsetInBlock(voxel);
  return block ? viewVoxel(map, rules, index, *block, offset) : viewVoxel(map, rules, index, Block(), offset);
}

}  // namespace bki_mapping
