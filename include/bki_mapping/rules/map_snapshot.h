/// @file What readers of a map are given while mapping goes on.
#pragma once

#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/rules/state_rules.h"

namespace bki_mapping {

/// A map as it was at some time, and the rules of that time. SemanticMap::snapshot() copies no block.
struct MapSnapshot {
  SemanticMap map;
  StateRules rules;
};

}  // namespace bki_mapping
