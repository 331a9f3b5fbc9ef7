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
  // Enough for tables in voxels of 0.1 m; what moves leaves it behind within a few scans.
  constexpr double kReach = 0.3;  // [m]
  if (classes.saysWhatMoves()) return 0;
  constexpr double kRounding = 1e-6;  // 0.3 / 0.1 is a little less than 3
  return static_cast<int>(
      std::clamp(std::floor(kReach / resolution + kRounding), 1.0, 1.0 * ScanRules::kMostThinReach));
}

}  // namespace bki_mapping
