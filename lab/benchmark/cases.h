/// @file The settings to be timed.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace bki_mapping::benchmark {

/// Settings to be timed, with their name in the tables.
struct Case {
  std::string name;
  std::map<std::string, std::string> settings;
};

inline std::vector<Case> modeCases() {
  return {
      {"none", {{"free_space/mode", "none"}}},
      {"linear, 1 sample", {{"free_space/mode", "linear"}}},
      {"linear, 5 samples", {{"free_space/mode", "linear"}, {"free_space/samples_per_beam", "5"}}},
      {"uniform, 1 sample", {{"free_space/mode", "uniform"}}},
      {"even, gap 1 m", {{"free_space/mode", "even"}}},
      {"line, bilinear, mapped", {{"free_space/extent", "mapped"}}},
      {"line, bilinear, observed", {{"free_space/extent", "observed"}}},
  };
}

}  // namespace bki_mapping::benchmark
