// Each rule that is left out is missing, and no other.
#include <gtest/gtest.h>

#include <map>
#include <memory>
#include <set>
#include <sstream>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/rules/scan_rules.h"
#include "bki_mapping/rules/state_rules.h"
#include "evaluation/left_out.h"
#include "refusal_of.h"

namespace bki_mapping {
namespace {

enum : ClassId { kRoadClass, kWallClass, kCarClass, kPersonClass };

ClassTable tableOfRules() {
  std::vector<SemanticClass> classes(4);
  for (ClassId id = 0; id < 4; ++id) {
    classes[id].id = id;
    classes[id].name = "class " + std::to_string(id);
    classes[id].raw = {id};
  }
  classes[kRoadClass].ground = true;
  classes[kCarClass].dynamic = classes[kPersonClass].dynamic = classes[kPersonClass].living = true;
  return ClassTable("rules", classes);
}

MapperConfig robotConfig() {
  MapperConfig config;
  config.resolution = 0.1;
  config.rules.enabled = true;
  config.free_space.mode = "line";
  config.sensor_model.height = 1.0;
  return config;
}

/// For each rule, a value that changes when it is left out.
std::map<std::string, double> saidBy(const MapperConfig& config) {
  const ScanRules scan(config.rules);
  const StateRules state(config.rules, tableOfRules(), config.resolution);
  const double many = 100.0 * RulesConfig::kHit;
  // A beam that nearly touches the ground, whose free space the threshold takes.
  SemanticMapper mapper(config, std::make_shared<const ClassTable>(tableOfRules()));
  Scan level;
  level.points = {{10.0f, 0.0f, -1.0f}};
  level.labels = {kRoadClass};
  mapper.integrate(level);
  std::size_t free = 0;
  for (const auto& [index, block] : mapper.map().entries()) {
    for (std::size_t p = 0; p < block->classes().size(); ++p) {
      if (block->classes()[p] != kFreeClass) continue;
      for (int v = 0; v < kBlockVoxels; ++v) free += block->plane(p)[v] > 0;
    }
  }
  return {
      {"hits_stay", scan.static_spread},
      {"hits_first", scan.hits_before_misses},
      {"hit_limit", scan.most_hits},
      {"threshold", static_cast<double>(free)},
      {"voids", scan.void_evidence},
      {"passing", state.freeGain(kCarClass, 0.0f)},
      {"standing", state.freeGain(kCarClass, static_cast<float>(many))},
      {"living", state.standsAfter(kPersonClass) > state.standsAfter(kCarClass)},
      {"fixed_gain", state.freeGain(kWallClass, 0.0f)},
      {"edge", state.standsAfter(kCarClass)},
      {"remaining", state.remainingGain()},
      {"neighbours", state.neighbourhoodRatio()},
      {"vote_limit", state.mostVote()},
      {"looks", state.latestDecides()},
      {"has_stayed", state.staysFrom()},
      {"arrived stays", state.arrivedStaysFrom()},
      {"hidden", state.hiddenAsk()},
      {"what is hidden votes", state.hiddenVotesFrom()},
      {"free_sum_limit", state.mostFree()},
  };
}

TEST(LeftOut, IsMissing) {
  const auto with = saidBy(robotConfig());
  std::istringstream names(namesOfRules());
  std::size_t count = 0;
  for (std::string name; std::getline(names >> std::ws, name, ',');) {
    SCOPED_TRACE(name);
    ++count;
    ASSERT_EQ(with.count(name), 1u);
    std::set<std::string> changed;
    for (const auto& [rule, value] : saidBy(withoutRule(robotConfig(), name))) {
      if (value != with.at(rule)) changed.insert(rule);
    }
    std::set<std::string> expected = {name};
    // All or nothing stands, whether it lives or not, in voxels of any size.
    if (name == "passing" || name == "standing") expected.insert({"living", "edge"});
    if (name == "looks") expected.insert({"hidden", "free_sum_limit"});
    if (name == "neighbours") expected.insert("hidden");
    if (name == "has_stayed") expected.insert("arrived stays");
    EXPECT_EQ(changed, expected);
  }
  EXPECT_EQ(count + 2, with.size());
}

TEST(LeftOut, RefusesWhatIsNoRule) {
  const auto withoutIt = [](const MapperConfig& config, const std::string& name) {
    return refusalOf([&] { withoutRule(config, name); });
  };
  EXPECT_NE(withoutIt(robotConfig(), "void").find("there is no rule 'void'"), std::string::npos);
  EXPECT_NE(withoutIt(robotConfig(), "void").find(", voids, "), std::string::npos);
  MapperConfig paper;
  EXPECT_NE(withoutIt(paper, "voids").find("rules/enabled is false"), std::string::npos);
}

}  // namespace
}  // namespace bki_mapping
