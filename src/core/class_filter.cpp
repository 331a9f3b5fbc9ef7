#include "bki_mapping/core/class_table.h"

#include <stdexcept>

namespace bki_mapping {

ClassFilter ClassFilter::all() {
  return allBut({});
}

ClassFilter ClassFilter::of(const ClassTable& table, const std::vector<std::string>& names) {
  ClassFilter set;
  std::string missing;
  for (const std::string& name : names) {
    bool found = false;
    for (const SemanticClass& known : table.classes()) {
      if (known.name != name) continue;
      set.insert(known.id);
      found = true;
    }
    if (!found) missing += (missing.empty() ? "'" : ", '") + name + "'";
  }
  if (missing.empty()) return set;
  std::string known_names;
  for (const SemanticClass& known : table.classes()) {
    known_names += (known_names.empty() ? "" : ", ") + known.name;
  }
  throw std::invalid_argument("class table '" + table.name() + "' has no class " + missing +
                              "; it has: " + known_names);
}

ClassFilter ClassFilter::allBut(const ClassFilter& others) {
  ClassFilter set;
  for (std::size_t id = 0; id < kMaxClasses; ++id) set.ids_[id] = !others.ids_[id];
  return set;
}

void ClassFilter::insert(ClassId id) {
  if (id >= kMaxClasses) {
    throw std::invalid_argument("class " + std::to_string(id) +
                                " cannot be in a set of classes; ids are 0 to 253");
  }
  ids_.set(id);
}

std::vector<ClassId> ClassFilter::ids() const {
  std::vector<ClassId> ids;
  for (std::size_t id = 0; id < kMaxClasses; ++id) {
    if (ids_[id]) ids.push_back(static_cast<ClassId>(id));
  }
  return ids;
}

}  // namespace bki_mapping
