#include "rules/class_sets.h"

#include <algorithm>
#include <cmath>

#include "bki_mapping/rules/scan_rules.h"

namespace bki_mapping {
namespace {

/// A distance, rounded down, and at most ScanRules::kMostReach [voxels].
int wholeVoxels(double metres, double resolution) {
  constexpr double kRounding = 1e-6;  // 0.3 / 0.1 is a little less than 3
  return static_cast<int>(std::min(std::floor(metres / resolution + kRounding), 1.0 * ScanRules::kMostReach));
}

}  // namespace

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
  return classes.saysWhatMoves() ? 0 : std::max(wholeVoxels(kReach, resolution), 1);
}

int voidMargin(double margin, double resolution) {
  return wholeVoxels(margin, resolution);
}

}  // namespace bki_mapping
