#include "requests.h"

#include <stdexcept>

namespace bki_mapping::ros_interface {

void checkBatch(std::size_t count, std::size_t most, const char* what) {
  if (count <= most) return;
  throw std::invalid_argument("the call has " + std::to_string(count) + " " + what + "; split it, " +
                              std::to_string(most) + " are the most");
}

ClassFilter classesOf(const ClassTable& table, const std::vector<std::string>& names, bool all_but) {
  checkBatch(names.size(), kMaxClasses, "names of classes");
  const ClassFilter named = ClassFilter::of(table, names);
  return names.empty() || all_but ? ClassFilter::allBut(named) : named;
}

}  // namespace bki_mapping::ros_interface
