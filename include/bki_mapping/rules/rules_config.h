/// @file Settings of the rules that the paper does not have, in scans and metres; docs/method.md has the
/// rules.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>

namespace bki_mapping {

/// Rules that can be left out, to measure what each gives.
enum class Rule : std::uint8_t {
  kHitsStay,      ///< (3a): hits of static classes stay in their voxel
  kHitsFirst,     ///< hits before misses
  kHitLimit,      ///< (14): of the hits of a scan
  kThreshold,     ///< (14): T_f
  kPassing,       ///< (12): without it, all that can move stands from its first hit on
  kStanding,      ///< (12): without it, nothing that can move stands
  kLiving,        ///< (12): without it, people stand after as many scans as cars
  kFixedGain,     ///< (12): 0 for what cannot move; without it, 1
  kEdge,          ///< (12): E grows with the voxel's edge
  kRemaining,     ///< (12a)
  kNeighbours,    ///< (12b)
  kVoteLimit,     ///< (12b): the 16 L_h of a vote
  kHasStayed,     ///< (12c): what has stayed is occupied
  kHidden,        ///< (12c): what is around decides where beams have hardly been since
  kFreeSumLimit,  ///< (12c): the 300 L_h of the evidence for `free`
};
constexpr std::size_t kRules = static_cast<std::size_t>(Rule::kFreeSumLimit) + 1;

/// With `enabled`, a scan counts once in a voxel, however many of its points and beams there are, and the
/// rules of docs/method.md, "Ours", apply. By default none applies: the map is the paper's.
struct RulesConfig {
  bool enabled = false;
  double void_outweighs = 30.0;       ///< number of scans that hit a voxel, to outweigh one that sees it void
  double void_margin = 0.0;           ///< no voxel this near to a hit of what can move is void [m]
  double stands_after = 8.0;          ///< number of scans with hits from which on what can be parked stands
  double living_stands_after = 20.0;  ///< the same for classes flagged living
  double fixed_stands_after = 1.0;    ///< for classes that cannot move and are no ground
  double together = 0.8;              ///< how far away voxels decide together [m]; 0: each by itself
  /// Up to which range a hit near which few other beams end is a drop, a flake, fog or dust [m]; 0: none is.
  double particles_within = 0.0;
  bool latest = true;  ///< whether what the latest scans saw of a voxel comes first
  /// Rules to leave out, by their position; evaluate_map sets this, no parameter does, and no file keeps it.
  std::bitset<kRules> without;
  bool has(Rule rule) const { return !without[static_cast<std::size_t>(rule)]; }

  // Evidence of a scan. Only ratios matter. The kernel's peak is far above what a scan may add, so that
  // hits count alike wherever they are in their voxel; the prior is far below.
  static constexpr double kPeak = 0.3, kPrior = 1e-4;
  /// Of a scan that crosses a voxel, and the least sum of its beams that counts as crossing: 1/200 of the
  /// peak is well above what the fringe of a kernel adds.
  static constexpr double kCrossing = kPeak / 200.0;
  /// Of a scan that hits a voxel: it outweighs 13 that cross it, because beams graze what is parked in many
  /// scans. With 8 or 20, maps are hardly worse or better.
  static constexpr double kHit = 13.0 * kCrossing;
  double emptiness() const { return void_outweighs * kHit; }  ///< of one that sees a voxel void
};

}  // namespace bki_mapping
