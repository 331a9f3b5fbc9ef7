/// @file The settings that decide the state of a voxel when a map is read; voxel_state.h applies them. The
/// map itself holds only what was seen.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/rules/free_gain_config.h"

namespace bki_mapping {

/// What a voxel is, given its evidence and that around it: Equations 11 to 12c in docs/method.md. Only (11)
/// follows from the paper; by default no other rule applies. A value that does not change: `with...` returns
/// another one.
class StateRules {
 public:
  StateRules() { free_gains_.fill(1.0f); }
  StateRules(const FreeGainConfig& config, const ClassTable& classes);

  /// Gain on the evidence for `free`; 1 unless set. With a persistence P > 0, a gain above 1 decays towards 1
  /// as 1 + (gain - 1) exp(-hits / P), so that an object that is hit scan after scan stays occupied even if
  /// its class can move (Equation 12).
  /// @param id of the class with the most evidence. @param hits the evidence for that class.
  float freeGain(ClassId id, float hits) const {
    const float gain = free_gains_[id];
    if (gain <= 1.0f || persistence_ <= 0.0f) return gain;
    return 1.0f + (gain - 1.0f) * std::exp(-hits / persistence_);
  }
  /// Whether the gain of a class without hits is above 1, as that of classes that can move should be.
  bool canLeave(ClassId id) const { return free_gains_[id] > 1.0f; }
  StateRules withFreeGain(ClassId id, double gain) const;
  /// @param persistence in units of evidence; 0: gains do not decay.
  StateRules withPersistence(double persistence) const;

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
  /// @param is_below false where floors ask, too: they would keep whatever moves on them.
  StateRules withNeighbourhood(double ratio, const ClassSet& asking, bool is_below = true) const;
  /// The most that one voxel counts for in a neighbourhood [units].
  EvidenceUnits mostVote() const {
    constexpr float kPersistences = 8.0f, kMost = kMostVote * kEvidenceUnit;
    if (!(persistence_ > 0.0f)) return kMostVote;
    return std::max(unitsOf(std::min(kPersistences * persistence_, kMost)), 1);
  }
  /// The same without a persistence, or with one above 16; sums over a neighbourhood then still fit 32 bits.
  static constexpr EvidenceUnits kMostVote = 1 << 23;

  /// Whether what the latest scans saw of a voxel decides, where that is clear, and not the sum (Equation
  /// 12c).
  bool latestDecides() const { return latest_decides_; }
  StateRules withLatest(bool decides) const;

  /// Whether equal blocks, with equal blocks around, have the same states and labels by these
  /// rules and by the others.
  bool decidesAs(const StateRules& other) const;

 private:
  std::array<float, 256> free_gains_;
  float persistence_ = 0.0f, remaining_gain_ = 0.0f, neighbourhood_ratio_ = 0.0f;
  ClassSet fixed_, asking_;
  bool neighbourhood_is_below_ = true, latest_decides_ = false;
};

}  // namespace bki_mapping
