/// @file The named parameters of FreeSpaceConfig.
#pragma once

#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/free_space/free_space_config.h"
#include "free_space/free_space_model.h"

namespace bki_mapping {

inline std::vector<NamedParameter<FreeSpaceConfig>> freeSpaceParameters() {
  using C = FreeSpaceConfig;
  constexpr double kMostSeed = 9007199254740991.0;  // 2^53 - 1: larger integers have no exact text
  return {
      wordParameter(
          "mode", &C::mode, freeSpaceModes(), Changes::kWhileMapping,
          "How beams mark space as free: none leaves it unknown; even adds a sample every free_space/gap; "
          "uniform and linear add random samples; line adds whole beams. Use line where moving "
          "objects must disappear from the map, linear where time is short."),
      realParameter("gap", &C::gap, NumberRange::atLeast(0.01).slider(0.01, 100.0), "m",
                    Changes::kWhileMapping,
                    "Distance between the samples on a beam in mode even. A larger gap takes less time and "
                    "leaves more free voxels unknown."),
      integerParameter("samples_per_beam", &C::samples_per_beam, NumberRange::atLeast(1).upTo(1000),
                       Changes::kWhileMapping,
                       "Number of random samples on each beam in modes uniform and linear. More samples take "
                       "more time and leave fewer free voxels unknown."),
      integerParameter("seed", &C::seed, NumberRange::atLeast(0).upTo(kMostSeed), Changes::kAtStart,
                       "Seed of the random samples in modes uniform and linear. The same seed gives the same "
                       "map."),
      choiceParameter(
          "weight", &C::weight, {"uniform", "linear", "bilinear"}, Changes::kWhileMapping,
          "Weight along a beam in mode line: uniform is 1, linear is rho, bilinear is min(rho, 1 - "
          "rho), where rho is 0 at the sensor and 1 at the hit. Use bilinear to keep surfaces from "
          "being cleared."),
      choiceParameter(
          "extent", &C::extent, {"mapped", "observed"}, Changes::kWhileMapping,
          "Which blocks mode line clears: mapped takes those that exist already, which is faster; "
          "observed takes all that beams cross, so that the map shows free space, too."),
      choiceParameter("beam_index", &C::beam_index, {"table", "rtree"}, Changes::kAtStart,
                      "Index that finds the beams near a block. Keep table, which is faster; rtree is the "
                      "paper's and gives the same map."),
  };
}

}  // namespace bki_mapping
