#include "evaluation/left_out.h"

#include <algorithm>
#include <iterator>
#include <stdexcept>

namespace bki_mapping {
namespace {

template <Rule kRule>
void without(RulesConfig& rules) {
  rules.without.set(static_cast<std::size_t>(kRule));
}

struct NamedRule {
  const char* name;
  void (*leave_out)(RulesConfig& rules);
};
/// In the order of docs/method.md.
constexpr NamedRule kNamedRules[] = {
    {"hits_stay", without<Rule::kHitsStay>},
    {"hits_first", without<Rule::kHitsFirst>},
    {"hit_limit", without<Rule::kHitLimit>},
    {"threshold", without<Rule::kThreshold>},
    {"voids", [](RulesConfig& rules) { rules.void_outweighs = 0.0; }},
    {"passing", without<Rule::kPassing>},
    {"standing", without<Rule::kStanding>},
    {"living", without<Rule::kLiving>},
    {"fixed_gain", without<Rule::kFixedGain>},
    {"edge", without<Rule::kEdge>},
    {"remaining", without<Rule::kRemaining>},
    {"neighbours", without<Rule::kNeighbours>},
    {"vote_limit", without<Rule::kVoteLimit>},
    {"looks", [](RulesConfig& rules) { rules.latest = false; }},
    {"has_stayed", without<Rule::kHasStayed>},
    {"hidden", without<Rule::kHidden>},
    {"free_sum_limit", without<Rule::kFreeSumLimit>},
};

}  // namespace

std::string namesOfRules() {
  std::string all;
  for (const NamedRule& rule : kNamedRules) all += (all.empty() ? "" : ", ") + std::string(rule.name);
  return all;
}

MapperConfig withoutRule(MapperConfig config, const std::string& name) {
  const auto* const rule = std::find_if(std::begin(kNamedRules), std::end(kNamedRules),
                                        [&](const NamedRule& r) { return r.name == name; });
  if (rule == std::end(kNamedRules)) {
    throw std::invalid_argument("there is no rule '" + name + "' to leave out; known: " + namesOfRules());
  }
  if (!config.rules.enabled) {
    throw std::invalid_argument(
        "no rule can be left out, because rules/enabled is false; use a preset with "
        "rules, such as robot");
  }
  rule->leave_out(config.rules);
  return config;
}

}  // namespace bki_mapping
