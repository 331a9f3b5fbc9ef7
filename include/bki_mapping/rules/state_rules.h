/// @file The settings that decide the state of a voxel when a map is read; voxel_state.h applies them. The
/// map itself holds only what was seen.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/rules/rules_config.h"

namespace bki_mapping {

/// What a voxel is, given its evidence and that around it; docs/method.md has the equations. Only (11)
/// follows from the paper; by default no other rule applies. A value that does not change: `with...` returns
/// another one.
class StateRules {
 public:
  StateRules() { free_gains_.fill(1.0f), standing_gains_.fill(1.0f), stands_after_.fill(0.0f); }
  /// @param resolution edge of a voxel [m].
  StateRules(const RulesConfig& config, const ClassTable& classes, double resolution);

  /// The settings that it was made from, if they are enabled; otherwise the defaults, which are not.
  const RulesConfig& config() const { return config_; }

  /// Gain on the evidence for `free`; 1 unless set. It may change from some evidence of hits on: a gain above
  /// 1 is that of what passes, and 1 when it stands; the gain of what cannot move becomes 0 (Equation 12).
  /// @param id of the class with the most evidence. @param hits the evidence for that class.
  float freeGain(ClassId id, float hits) const {
    return hits >= stands_after_[id] ? standing_gains_[id] : free_gains_[id];
  }
  /// Evidence of hits from which on the gain is standingGain(); infinite if it never is.
  float standsAfter(ClassId id) const { return stands_after_[id]; }
  float standingGain(ClassId id) const { return standing_gains_[id]; }
  /// Whether the gain of a class without hits is above 1, as that of classes that can move should be, and not
  /// only until a second scan confirms the first.
  bool canLeave(ClassId id) const { return free_gains_[id] > 1.0f && standing_gains_[id] > 0.0f; }
  /// @param stands_after evidence of hits, for a gain above 1.
  StateRules withFreeGain(ClassId id, double gain,
                          double stands_after = std::numeric_limits<double>::infinity()) const;
  /// Of a class that cannot move: the gain is 0, but `gain` with less evidence of hits than `confirmed`.
  StateRules withConfirmation(ClassId id, double gain, double confirmed) const;

  /// Gain with which a fixed class, one that cannot move, keeps a voxel that its likeliest class has left; 0,
  /// the default: such a voxel is free (Equation 12a).
  float remainingGain() const { return remaining_gain_; }
  bool isFixed(ClassId id) const { return fixed_[id]; }
  StateRules withRemaining(double gain, const ClassSet& fixed) const;

  /// The ratio of evidence at which its neighbourhood keeps a voxel whose likeliest class asks it; 0, the
  /// default: each voxel decides by itself (Equation 12b).
  float neighbourhoodRatio() const { return neighbourhood_ratio_; }
  bool asksNeighbourhood(ClassId id) const { return asking_[id]; }
  /// Whether the neighbourhood of a voxel includes voxels below it.
  bool neighbourhoodIsBelow() const { return neighbourhood_is_below_; }
  /// The voxels that are asked are those of a cube about the voxel, this far from it along each axis.
  int neighbourhoodReach() const { return neighbourhood_reach_; }
  static constexpr int kMostReach = 7;
  /// @param is_below false where floors ask, too: they would keep whatever moves on them. @param reach 1 to
  /// kMostReach [voxels].
  StateRules withNeighbourhood(double ratio, const ClassSet& asking, bool is_below = true,
                               int reach = 2) const;

  /// @param evidence of a scan that hits a voxel; 0: not known.
  StateRules withHitOfScan(double evidence) const;
  /// The most that one voxel counts for in a neighbourhood [units]: the hits of kMostVotes scans; beyond
  /// that, further hits say nothing new.
  EvidenceUnits mostVote() const { return config_.has(Rule::kVoteLimit) ? evidenceOfVotes() : kMostVote; }
  static constexpr int kMostVotes = 16;
  /// The same where the evidence of a scan is not known or large; sums over a neighbourhood then still fit 32
  /// bits.
  static constexpr EvidenceUnits kMostVote = 1 << 19;

  /// Whether what the latest scans saw of a voxel decides, where that is clear, and not the sum (Equation
  /// 12c).
  bool latestDecides() const { return latest_decides_; }
  StateRules withLatest(bool decides) const;

  /// Evidence of the likeliest class from which on a voxel has stayed [units]: it is occupied while nobody
  /// has looked at it since its last hit.
  EvidenceUnits staysFrom() const {
    static_assert(kStaysAfter % kMostVotes == 0);
    return config_.has(Rule::kHasStayed) ? kStaysAfter / kMostVotes * evidenceOfVotes() : kMostUnits;
  }
  static constexpr int kStaysAfter = 160;  ///< 16 s at 10 Hz
  /// The same as staysFrom() for a voxel that an earlier visit saw free [units].
  EvidenceUnits arrivedStaysFrom() const {
    return config_.has(Rule::kHasStayed) ? (evidenceOfVotes() + 1) / 2 : kMostUnits;
  }

  /// Whether voxels that no beam, or hardly any, has crossed since their last hit ask the voxels around
  /// whether what was hit is still there (Equation 12c). Not where floors ask, too: they always are.
  bool hiddenAsk() const {
    return latest_decides_ && neighbourhood_ratio_ > 0.0f && neighbourhood_is_below_ &&
           config_.has(Rule::kHidden);
  }

  /// Evidence of the likeliest class from which on a voxel that is hidden since its last hit votes for what
  /// is still there [units]: fewer hits may be of what passed.
  EvidenceUnits hiddenVotesFrom() const {
    static_assert(kHiddenVotesAfter % kMostVotes == 0);
    return kHiddenVotesAfter / kMostVotes * evidenceOfVotes();
  }
  static constexpr int kHiddenVotesAfter = 64;  ///< 6.4 s at 10 Hz

  /// The most that evidence for `free` counts for [units]: where the latest looks decide, the hits of
  /// kMostFree scans. What has been hit in more stands until it is seen void, however long space was free
  /// before it came.
  EvidenceUnits mostFree() const {
    if (!latest_decides_ || !(hit_of_scan_ > 0.0f) || !config_.has(Rule::kFreeSumLimit)) return kMostUnits;
    return unitsOf(kMostFree * std::min(static_cast<double>(hit_of_scan_), 1.0));
  }
  static constexpr int kMostFree = 300;

  /// Whether these rules are the others: equal blocks, with equal blocks around, then have the same states
  /// and labels.
  bool decidesAs(const StateRules& other) const;

 private:
  /// The evidence of the hits of kMostVotes scans [units].
  EvidenceUnits evidenceOfVotes() const {
    if (!(hit_of_scan_ > 0.0f)) return kMostVote;
    return std::max(unitsOf(std::min(kMostVotes * hit_of_scan_, kMostVote * kEvidenceUnit)), 1);
  }

  RulesConfig config_;
  std::array<float, 256> free_gains_, standing_gains_, stands_after_;
  float hit_of_scan_ = 0.0f, remaining_gain_ = 0.0f, neighbourhood_ratio_ = 0.0f;
  int neighbourhood_reach_ = 2;
  ClassSet fixed_, asking_;
  bool neighbourhood_is_below_ = true, latest_decides_ = false;
};

}  // namespace bki_mapping
