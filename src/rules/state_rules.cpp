#include "bki_mapping/rules/state_rules.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "rules/class_sets.h"
#include "rules/rules_parameters.h"

namespace bki_mapping {
namespace {

/// Not infinite, whose product with no evidence would be no number.
float finite(double gain) {
  constexpr double kMost = 1e30;  // its product with the largest evidence is finite, too
  return static_cast<float>(std::min(gain, kMost));
}

/// Gain of what passes: a thousandth of a scan's free space outweighs several hits.
constexpr double kGainOfPassing = 3000.0;
/// Classes that cannot move keep their voxels, however many beams graze them; only looks clear them (12c).
constexpr double kGainOfFixed = 0.0;
/// A scan may take a flake for a wall: until enough scans have hit the voxel, four or five that cross it
/// clear it.
constexpr double kGainOfUnconfirmed = 3.0;
/// A fixed class remains where it was hit in one scan of about a hundred (12a).
constexpr double kRemaining = 0.1;
/// Of kept to cleared evidence (12b).
constexpr double kNeighbourhoodRatio = 1.0;
/// The same, and the gain of what passes, and the scans after which things stand, where no class says what
/// can move: most things stand, so a scan must cross a voxel cleanly to outweigh a hit.
constexpr double kRatioOfUnknown = 0.3, kGainOfUnknown = 20.0, kUnknownStandsAfter = 2.0;

/// Evidence from which on a thing stands that does so after this many scans with hits in a voxel of 0.3 m.
/// What passes is in a voxel for a time that grows with the voxel's edge; far away, what is parked is hit in
/// a share of the scans that grows with the edge, too. Half a hit may be missing.
double evidenceToStand(const RulesConfig& config, double scans, double resolution) {
  if (!config.has(Rule::kPassing)) return 0.0;
  if (!config.has(Rule::kStanding)) return std::numeric_limits<double>::infinity();
  constexpr double kUsual = 0.3;    // [m]
  constexpr double kGrowth = 1.25;  // with 1.5, too little of what is parked stands in voxels of 0.6 m
  const double growth = config.has(Rule::kEdge) ? std::pow(resolution / kUsual, kGrowth) : 1.0;
  return std::max(scans * growth - 0.5, 0.0) * RulesConfig::kHit;
}

bool haveSameValues(const RulesConfig& a, const RulesConfig& b) {
  const auto parameters = rulesParameters();
  return a.without == b.without &&
         std::all_of(parameters.begin(), parameters.end(), [&](const auto& p) { return p.equal(a, b); });
}

}  // namespace

StateRules::StateRules(const RulesConfig& config, const ClassTable& classes, double resolution)
    : StateRules() {
  if (!config.enabled) return;
  config_ = config;
  const bool says_what_moves = classes.saysWhatMoves();
  const int reach =
      static_cast<int>(std::lround(std::clamp(config.together / resolution, 1.0, 1.0 * kMostReach)));
  const double ratio = !(config.together > 0.0) || !config.has(Rule::kNeighbours) ? 0.0
                       : says_what_moves                                          ? kNeighbourhoodRatio
                                                                                  : kRatioOfUnknown;
  *this = withHitOfScan(RulesConfig::kHit)
              .withRemaining(config.has(Rule::kRemaining) ? kRemaining : 0.0, fixedClasses(classes))
              // Where floors ask, too, they would keep whatever moves on them: the layers below are left out.
              .withNeighbourhood(ratio, askingClasses(classes), says_what_moves, reach)
              .withLatest(config.latest);
  for (const SemanticClass& c : classes.classes()) {
    if (c.free_gain) {
      *this = withFreeGain(c.id, *c.free_gain);
    } else if (c.dynamic || (!says_what_moves && !c.unlabelled)) {
      const double scans = !says_what_moves ? std::min(kUnknownStandsAfter, config.stands_after)
                           : c.living && config.has(Rule::kLiving) ? config.living_stands_after
                                                                   : config.stands_after;
      *this = withFreeGain(c.id, says_what_moves ? kGainOfPassing : kGainOfUnknown,
                           evidenceToStand(config, scans, resolution));
    } else if (!c.unlabelled) {
      *this = withFreeGain(c.id, config.has(Rule::kFixedGain) ? kGainOfFixed : 1.0);
      const double confirmed = config.fixed_stands_after;  // half a hit may be missing
      if (confirmed > 1.0 && !c.ground && config.has(Rule::kFixedGain))
        *this = withConfirmation(c.id, kGainOfUnconfirmed, (confirmed - 0.5) * RulesConfig::kHit);
    }
  }
}

StateRules StateRules::withFreeGain(ClassId id, double gain, double stands_after) const {
  StateRules rules = *this;
  rules.free_gains_[id] = finite(gain);
  rules.standing_gains_[id] = std::min(finite(gain), 1.0f);
  rules.stands_after_[id] = static_cast<float>(stands_after);
  return rules;
}

StateRules StateRules::withConfirmation(ClassId id, double gain, double confirmed) const {
  StateRules rules = withFreeGain(id, gain, confirmed);
  rules.standing_gains_[id] = 0.0f;
  return rules;
}

StateRules StateRules::withHitOfScan(double evidence) const {
  StateRules rules = *this;
  rules.hit_of_scan_ = static_cast<float>(evidence);
  return rules;
}

StateRules StateRules::withRemaining(double gain, const ClassSet& fixed) const {
  constexpr double kLeast = std::numeric_limits<float>::min();  // 0 would switch the rule off
  StateRules rules = *this;
  rules.remaining_gain_ = gain > 0.0 ? finite(std::max(gain, kLeast)) : 0.0f;
  rules.fixed_ = fixed;
  return rules;
}

StateRules StateRules::withNeighbourhood(double ratio, const ClassSet& asking, bool is_below,
                                         int reach) const {
  StateRules rules = *this;
  rules.neighbourhood_ratio_ = finite(ratio);
  rules.asking_ = asking;
  rules.neighbourhood_is_below_ = is_below;
  rules.neighbourhood_reach_ = reach;
  return rules;
}

StateRules StateRules::withLatest(bool decides) const {
  StateRules rules = *this;
  rules.latest_decides_ = decides;
  return rules;
}

bool StateRules::decidesAs(const StateRules& other) const {
  const auto all = [](const StateRules& r) {
    return std::tie(r.free_gains_, r.standing_gains_, r.stands_after_, r.hit_of_scan_, r.remaining_gain_,
                    r.fixed_, r.neighbourhood_ratio_, r.asking_, r.neighbourhood_is_below_,
                    r.neighbourhood_reach_, r.latest_decides_);
  };
  return haveSameValues(config_, other.config_) && all(*this) == all(other);
}

}  // namespace bki_mapping
