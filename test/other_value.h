// Another value of a parameter, whatever its type.
#pragma once

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping {

/// A value that the parameter may have, and `config` does not.
template <typename Config>
std::string otherValue(const NamedParameter<Config>& parameter, const Config& config) {
  std::vector<std::string> candidates = parameter.words;
  if (candidates.empty()) candidates = {"0.25", "7", "text"};
  for (const std::string& value : candidates) {
    Config changed = config;
    if (parameter.assign(changed, value) && parameter.get(changed) != parameter.get(config)) return value;
  }
  ADD_FAILURE() << parameter.name << " has no other value";
  return parameter.get(config);
}

/// Expects that each parameter sets a member of its own, and no other parameter's.
template <typename Config>
void expectOwnMembers(const std::vector<NamedParameter<Config>>& parameters) {
  const Config defaults;
  for (const NamedParameter<Config>& set : parameters) {
    Config config;
    const std::string value = otherValue(set, config);
    set.set(config, value);
    EXPECT_EQ(set.get(config), value) << set.name;
    for (const NamedParameter<Config>& p : parameters) {
      EXPECT_EQ(p.get(config) != p.get(defaults), p.name == set.name) << set.name << " sets " << p.name;
      EXPECT_EQ(!p.equal(config, defaults), p.name == set.name) << set.name << " sets " << p.name;
    }
  }
}

/// Expects that names differ, and that descriptions are sentences in one line.
template <typename Config>
void expectNamesAndDescriptions(const std::vector<NamedParameter<Config>>& parameters) {
  std::set<std::string> names;
  for (const NamedParameter<Config>& p : parameters) {
    EXPECT_TRUE(names.insert(p.name).second) << p.name << " stands twice";
    ASSERT_FALSE(p.description.empty()) << p.name;
    EXPECT_EQ(p.description.back(), '.') << p.name;
    EXPECT_EQ(p.description.find('\n'), std::string::npos) << p.name;
  }
}

}  // namespace bki_mapping
