#include "bki_mapping/rules/state_rules.h"

#include <limits>

#include "rules/class_sets.h"

namespace bki_mapping {
namespace {

/// Not infinite, whose product with no evidence would be no number.
float finite(double gain) {
  constexpr double kMost = 1e30;  // its product with the largest evidence is finite, too
  return static_cast<float>(std::min(gain, kMost));
}

/// The gain of a class that sets none itself.
double gainOf(const SemanticClass& c, const FreeGainConfig& config) {
  if (c.unlabelled) return 1.0;
  if (!c.dynamic) return config.static_classes;
  return c.living ? config.ofLiving() : config.dynamic_classes;
}

}  // namespace

StateRules::StateRules(const FreeGainConfig& config, const ClassTable& classes)
    : StateRules(StateRules()
                     .withPersistence(config.persistence)
                     .withRemaining(config.remaining, fixedClasses(classes))
                     // Where floors ask, too, they would keep whatever moves on them: the layers below are
                     // left out.
                     .withNeighbourhood(config.neighbourhood, askingClasses(classes), classes.saysWhatMoves())
                     .withLatest(config.latest)) {
  for (const SemanticClass& c : classes.classes()) {
    free_gains_[c.id] = finite(c.free_gain.value_or(gainOf(c, config)));
  }
}

StateRules StateRules::withFreeGain(ClassId id, double gain) const {
  StateRules rules = *this;
  rules.free_gains_[id] = finite(gain);
  return rules;
}

StateRules StateRules::withPersistence(double persistence) const {
  StateRules rules = *this;
  rules.persistence_ = static_cast<float>(persistence);
  return rules;
}

StateRules StateRules::withRemaining(double gain, const ClassSet& fixed) const {
  constexpr double kLeast = std::numeric_limits<float>::min();  // 0 would switch the rule off
  StateRules rules = *this;
  rules.remaining_gain_ = gain > 0.0 ? finite(std::max(gain, kLeast)) : 0.0f;
  rules.fixed_ = fixed;
  return rules;
}

StateRules StateRules::withNeighbourhood(double ratio, const ClassSet& asking, bool is_below) const {
  StateRules rules = *this;
  rules.neighbourhood_ratio_ = finite(ratio);
  rules.asking_ = asking;
  rules.neighbourhood_is_below_ = is_below;
  return rules;
}

StateRules StateRules::withLatest(bool decides) const {
  StateRules rules = *this;
  rules.latest_decides_ = decides;
  return rules;
}

bool StateRules::decidesAs(const StateRules& other) const {
  return free_gains_ == other.free_gains_ && persistence_ == other.persistence_ &&
         (neighbourhood_ratio_ == 0.0f ||
          (asking_ == other.asking_ && neighbourhood_is_below_ == other.neighbourhood_is_below_)) &&
         latest_decides_ == other.latest_decides_ && neighbourhood_ratio_ == other.neighbourhood_ratio_ &&
         remaining_gain_ == other.remaining_gain_ && (remaining_gain_ == 0.0f || fixed_ == other.fixed_);
}

}  // namespace bki_mapping
