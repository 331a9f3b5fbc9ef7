#include "rules/class_sets.h"

#include <algorithm>
#include <cmath>

#include "bki_mapping/rules/scan_rules.h"

namespace bki_mapping {

ClassSet fixedClasses(const ClassTable& classes) {
  ClassSet fixed;
  for (const SemanticClass& c : classes.classes()) fixed[c.id] = !c.dynamic && !c.unlabelled;
  return fixed;
}

ClassSet askingClasses(const ClassTable& classes) {
  const bool says_what_moves = classes.saysWhatMoves();
  ClassSet asking;
  for (const SemanticClass& c : classes.classes()) {
    asking[c.id] = !c.unlabelled && (!says_what_moves || (c.dynamic && !c.living));
  }
  return asking;
}

int thinReach(const ClassTable& classes, double resolution) {
  // Less than what moves is wide, so that where it was seen empty it is still void in its middle.
  constexpr double kReach = 0.3;  // [m]
  if (classes.saysWhatMoves()) return 0;
  return static_cast<int>(std::lround(std::clamp(kReach / resolution, 1.0, 1.0 * ScanRules::kMostThinReach)));
}

}  // namespace bki_mapping
