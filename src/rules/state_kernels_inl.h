/// @file Reading the voxels of a block, a vector at a time, over the vocabulary of simd/vec.h. viewVoxel is
/// the same for one voxel, in double precision.
#pragma once

#include <algorithm>

#include "rules/occupancy_constants.h"
#include "rules/state_kernels.h"
#include "rules/vec_log_inl.h"

namespace bki_mapping {
namespace {

/// Sums of units over up to 255 planes, without rounding: of their upper and lower halves, each of which
/// stays below 2^24, so that floats hold it exactly, too.
struct ExactSum {
  IntVec high, low;

  [[gnu::always_inline]] void add(IntVec units) {
    high += units >> 16;
    low += units & 0xffff;
  }
  [[gnu::always_inline]] void subtract(IntVec units) {
    high -= units >> 16;
    low -= units & 0xffff;
  }
  /// The sum as evidence, rounded once.
  [[gnu::always_inline]] FloatVec evidence() const {
    static_assert(kEvidenceUnit == 0x1.0p-16f, "the upper half is a whole number of evidence");
    return ConvertTo<FloatVec>(high) + kEvidenceUnit * ConvertTo<FloatVec>(low);
  }
};

/// A sum with the rounding of each addition taken into account in the next (Kahan): there may be 255
/// terms.
struct CompensatedSum {
  FloatVec sum, lost;

  [[gnu::always_inline]] void add(FloatVec term) {
    const FloatVec corrected = term - lost, next = sum + corrected;
    lost = (next - sum) - corrected;
    sum = next;
  }
};

[[gnu::always_inline]] inline FloatVec evidenceOf(IntVec units) {
  return kEvidenceUnit * ConvertTo<FloatVec>(units);
}

/// What one pass over the planes finds.
struct Likeliest {
  IntVec best;    ///< evidence of the class with the most [units]
  IntVec label;   ///< that class; kFreeClass if no class has evidence
  FloatVec gain;  ///< of that class
  ExactSum classes;
  CompensatedSum squares;  ///< of the evidence of the classes
};

template <bool kPosterior>
[[gnu::always_inline]] inline Likeliest findLikeliest(const BlockPlanes& planes, int v) {
  Likeliest found = {{}, Set(kFreeClass), Set(1.0f), {{}, {}}, {{}, {}}};
  for (std::size_t p = 0; p < planes.count; ++p) {
    const BlockPlanes::Plane& plane = planes.planes[p];
    const IntVec units = Max(LoadU(plane.units + v), IntVec{});
    const Mask more = units > found.best;  // of equal evidence, the first class has the smaller id
    found.best = Max(units, found.best);
    found.label = IfThenElse(more, Set(plane.id), found.label);
    if constexpr (!kPosterior) continue;
    found.classes.add(units);
    const FloatVec evidence = evidenceOf(units);
    found.squares.add(evidence * evidence);
  }
  return found;
}

/// Finds the gains of the likeliest classes: StateRules::freeGain.
[[gnu::always_inline]] inline void findGains(const BlockPlanes& planes, Likeliest& found) {
  const FloatVec hits = evidenceOf(found.best);
  for (std::size_t p = 0; p < planes.count; ++p) {
    const BlockPlanes::Plane& plane = planes.planes[p];
    const Mask stands = hits >= plane.stands_after;
    const FloatVec gain = IfThenElse(stands, Set(plane.standing_gain), Set(plane.gain));
    found.gain = IfThenElse(found.label == plane.id, gain, found.gain);
  }
}

/// Equation 11, as isOccupied decides it.
[[gnu::always_inline]] inline Mask occupied(const Likeliest& found, IntVec free) {
  const FloatVec hits = evidenceOf(found.best), misses = found.gain * evidenceOf(free);
  const Mask plain = found.gain == 1.0f;
  const Mask result = IfThenElse(plain, found.best >= free, hits >= misses);
  constexpr float kRounding = 1e-6f;  // more than floats err by
  const Mask close = ~plain & (free > 0) & (Abs(hits - misses) <= kRounding * hits);
  if (!AnyTrue(close)) return result;
  std::int32_t exact[kLanes];
  StoreU(result, exact);
  for (int lane = 0; lane < kLanes; ++lane) {
    if (close[lane]) exact[lane] = -isOccupied(found.best[lane], found.gain[lane], free[lane]);
  }
  return LoadU(exact);
}

/// Equation 12a: where the likeliest class does not hold a voxel, the likeliest of the fixed classes may.
/// What holds it becomes what was found. @return the voxels that are occupied.
[[gnu::always_inline]] inline Mask keepRemaining(const BlockPlanes& planes, IntVec free, int v,
                                                 Mask is_occupied, Likeliest& found) {
  const float gain = planes.rules->remainingGain();
  const Mask left = ~is_occupied & (found.best > 0);
  if (!(gain > 0.0f) || !AnyTrue(left)) return is_occupied;
  Likeliest fixed = {{}, Set(kFreeClass), Set(gain), {{}, {}}, {{}, {}}};
  for (std::size_t p = 0; p < planes.count; ++p) {
    const BlockPlanes::Plane& plane = planes.planes[p];
    if (!plane.fixed) continue;
    const IntVec units = Max(LoadU(plane.units + v), IntVec{});
    fixed.label = IfThenElse(units > fixed.best, Set(plane.id), fixed.label);
    fixed.best = Max(units, fixed.best);
  }
  const Mask is_large = fixed.best > (found.best - 1) >> kRemainingShift;  // at least that share, rounded up
  const Mask remains =
      left & (fixed.best > 0) & (fixed.label != found.label) & is_large & occupied(fixed, free);
  found.best = IfThenElse(remains, fixed.best, found.best);
  found.label = IfThenElse(remains, fixed.label, found.label);
  found.gain = IfThenElse(remains, fixed.gain, found.gain);
  return is_occupied | remains;
}

/// What the entropy needs beyond Likeliest.
struct Concentrations {
  float prior;
  FloatVec inverse_sum;  ///< 1 / sum(alpha)
  FloatVec others;       ///< sum(alpha) minus the largest
};

/// - p log(p) of one concentration, of at most half the sum.
[[gnu::always_inline]] inline FloatVec entropyTerm(FloatVec alpha, const Concentrations& c) {
  const FloatVec p = alpha * c.inverse_sum;
  return -p * log(p);
}
/// 0 where the mask is set, else v.
[[gnu::always_inline]] inline FloatVec unless(Mask mask, FloatVec v) {
  return BitCast<FloatVec>(BitCast<IntVec>(v) & ~mask);
}

/// - sum of p log(p). Terms are of one sign, so that nothing cancels. The largest p may be near 1; its
/// logarithm comes from the sum of the others. All others are at most 1/2.
[[gnu::always_inline]] inline FloatVec entropyOf(const BlockPlanes& planes, const Likeliest& found,
                                                 IntVec free, const Concentrations& c, int v) {
  const Mask free_is_largest = (free > found.best) | (found.label == kFreeClass);
  const IntVec largest = IfThenElse(free_is_largest, Set(kFreeClass), found.label);
  const FloatVec alpha = c.prior + evidenceOf(Max(found.best, free));
  CompensatedSum entropy = {alpha * c.inverse_sum * logOnePlus(c.others / alpha), {}};
  // Where a class has no evidence, and where there is no plane for it, it has the prior.
  auto absent = Set(static_cast<float>(planes.map->classCount() - planes.count));
  for (std::size_t p = 0; p < planes.count; ++p) {
    const BlockPlanes::Plane& plane = planes.planes[p];
    const IntVec units = Max(LoadU(plane.units + v), IntVec{});
    if (AnyTrue(units != 0)) {
      entropy.add(unless(largest == plane.id, entropyTerm(c.prior + evidenceOf(units), c)));
    } else {
      absent += 1.0f;
    }
  }
  if (planes.has_free) {
    entropy.add(unless(free_is_largest, entropyTerm(c.prior + evidenceOf(free), c)));
  } else {
    absent += ConvertTo<FloatVec>(free_is_largest + 1);
  }
  entropy.add(absent * entropyTerm(Set(c.prior), c));
  return entropy.sum;
}

/// The priors of the map.
struct Priors {
  float once, classes, sum;  ///< of one concentration, of all classes, and of `free`, too
  float squares;             ///< sum of the squares of those of the classes
  float something, nothing;  ///< of what is in a voxel

  explicit Priors(const SemanticMap& map) {
    // Far below a unit of evidence a smaller prior makes no difference, and floats could not hold its square.
    const double least = 1e-18;
    const double prior = map.prior() > least ? map.prior() : least;
    const auto count = static_cast<double>(map.classCount());
    once = static_cast<float>(prior);
    classes = static_cast<float>(prior * count);
    sum = static_cast<float>(prior * (count + 1.0));
    squares = static_cast<float>(prior * prior * count);
    something = static_cast<float>(kPriorOfSomething * prior);
    nothing = static_cast<float>(kPriorOfNothing * prior);
  }
};

/// Equations 10 and 13 of a vector of voxels. @param found what decides the state: the likeliest class, or
/// what remains. @param counted the evidence for `free` as far as it counts for the state. @param restored
/// the voxels that are kept against their own evidence. @param has_left those that are free against it.
template <bool kEntropy>
[[gnu::always_inline]] inline void storePosterior(const BlockPlanes& planes, const Priors& prior,
                                                  const Likeliest& likeliest, const Likeliest& found,
                                                  IntVec free, IntVec counted, Mask is_occupied,
                                                  Mask restored, Mask has_left, int v, BlockView& view) {
  ExactSum total = found.classes;
  total.add(free);
  const FloatVec evidence = total.evidence(), sum = prior.sum + evidence, inverse_sum = 1.0f / sum;
  const IntVec own = IfThenElse(is_occupied, found.best, free);
  ExactSum others = total;
  others.subtract(own);
  const FloatVec p = (prior.once + evidenceOf(own)) * inverse_sum,
                 not_p = (prior.classes + others.evidence()) * inverse_sum;
  const FloatVec best = evidenceOf(found.best), alpha = prior.once + best,
                 weight = static_cast<float>(kWeightOfFree) * Max(found.gain, Set(1.0f)),
                 weighted_free = weight * unless(restored, evidenceOf(counted)),
                 something = prior.something + unless(has_left, best) +
                             static_cast<float>(kInFreeSpace) * weighted_free,
                 nothing = prior.nothing + static_cast<float>(kBesideSurfaces) * something + weighted_free;
  // The sum of (prior + e)^2 over the classes.
  const FloatVec squares = prior.squares + 2.0f * prior.once * found.classes.evidence() + found.squares.sum;
  StoreU(evidence, view.evidence.data() + v);
  StoreU(p, view.probability.data() + v);
  StoreU(p * not_p / (sum + 1.0f), view.variance.data() + v);
  StoreU(something / (something + nothing), view.occupancy.data() + v);
  StoreU(alpha * alpha / squares, view.class_probability.data() + v);
  if constexpr (!kEntropy) return;

  others = total;
  others.subtract(Max(likeliest.best, free));
  const Concentrations c = {prior.once, inverse_sum, prior.classes + others.evidence()};
  StoreU(entropyOf(planes, likeliest, free, c, v), view.entropy.data() + v);
}

/// Copies the posterior of one vector of voxels to another.
template <bool kEntropy>
[[gnu::always_inline]] inline void copyPosterior(int from, int to, BlockView& view) {
  const auto copy = [from, to](auto& field) { StoreU(LoadU(field.data() + from), field.data() + to); };
  copy(view.evidence);
  copy(view.probability);
  copy(view.variance);
  copy(view.occupancy);
  copy(view.class_probability);
  if constexpr (kEntropy) copy(view.entropy);
}

template <bool kPosterior, bool kEntropy>
void readPlanes(const BlockPlanes& planes, BlockView& view) {
  const Priors prior(*planes.map);
  int unknown = -1;  // first voxel of a vector without any evidence: all these vectors are alike
  for (int v = 0; v < kBlockVoxels; v += kLanes) {
    const IntVec free = Max(LoadU(planes.free + v), IntVec{}), counted = Min(free, Set(planes.most_free));
    Likeliest found = findLikeliest<kPosterior>(planes, v);
    const Mask is_known = (found.best | free) != 0;
    const Likeliest likeliest = found;
    Mask is_occupied = found.best > 0;
    const IntVec overruling = planes.overruled ? LoadU(planes.overruled->data() + v) : IntVec{};
    Mask restored = {}, has_left = {};
    // Elsewhere the gain makes no difference to the state.
    const Mask disputed = (is_occupied & (free > 0)) | (overruling != 0);
    if (kPosterior || AnyTrue(disputed)) {
      findGains(planes, found);
      is_occupied &= occupied(found, counted);
      restored = (overruling == kKept) & (found.best > 0) & ~is_occupied;
      const Mask cleared = (overruling == kCleared) & is_occupied;
      is_occupied = (is_occupied | restored) & ~cleared;
      is_occupied = keepRemaining(planes, free, v, is_occupied, found);
      has_left = cleared & ~is_occupied;  // where a fixed class remains, that is there
    }
    static_assert(static_cast<int>(VoxelState::kFree) == 1 && static_cast<int>(VoxelState::kOccupied) == 2);
    const IntVec state = (is_known & 1) - is_occupied, label = found.label | ~is_occupied;
    static_assert(kFreeClass == 0xff, "all bits set");
    StoreU(ConvertTo<ByteVec>(state), reinterpret_cast<std::uint8_t*>(view.state.data() + v));
    StoreU(ConvertTo<ByteVec>(label), view.label.data() + v);
    if constexpr (!kPosterior) continue;

    if (unknown >= 0 && !AnyTrue(is_known)) {
      copyPosterior<kEntropy>(unknown, v, view);
      continue;
    }
    if (!AnyTrue(is_known)) unknown = v;
    storePosterior<kEntropy>(planes, prior, likeliest, found, free, counted, is_occupied, restored, has_left,
                             v, view);
  }
}

inline bool readVotes(const BlockPlanes& planes, Block::Layers layers, BlockVotes& votes) {
  constexpr int kLayer = kBlockEdge * kBlockEdge;
  static_assert(kLayer % kLanes == 0, "vectors end with a layer");
  IntVec any = {};
  for (int v = kLayer * layers.begin; v < kLayer * layers.end; v += kLanes) {
    const IntVec free = Max(LoadU(planes.free + v), IntVec{});
    Likeliest found = findLikeliest<true>(planes, v);
    IntVec asks = {};
    for (std::size_t p = 0; p < planes.count; ++p) {
      if (planes.planes[p].asks) asks |= found.label == planes.planes[p].id;
    }
    const IntVec vote = Min(found.best, Set(planes.most_vote)) & asks;
    any |= vote;
    findGains(planes, found);
    const Mask is_kept = occupied(found, Min(free, Set(planes.most_free)));
    StoreU(vote & is_kept, votes.kept.data() + v);
    constexpr EvidenceUnits kMostHits = kMostUnits / kFreeOfOneHit;  // more outweigh all
    const Mask outweighs =
        (found.best > kMostHits) | (kFreeOfOneHit * Min(found.best, Set(kMostHits)) >= free);
    StoreU(vote & ~is_kept & outweighs, votes.doubtful.data() + v);
    StoreU((vote > 0) & is_kept & 1, votes.is_kept.data() + v);
    StoreU(vote & ~is_kept, votes.cleared.data() + v);
  }
  return AnyTrue(any != 0);
}

constexpr StateKernels kStateKernels = {kInstructionSet, readPlanes<false, false>, readPlanes<true, false>,
                                        readPlanes<true, true>, readVotes};

}  // namespace
}  // namespace bki_mapping
