#include "rules/class_sets.h"

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

}  // namespace bki_mapping
