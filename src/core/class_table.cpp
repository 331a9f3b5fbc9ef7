#include "bki_mapping/core/class_table.h"

#include <algorithm>
#include <set>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace bki_mapping {
namespace {

std::string hexText(std::uint32_t bits) {
  std::ostringstream text;
  text << "0x" << std::uppercase << std::hex << bits;
  return text.str();
}

}  // namespace

ClassTable::ClassTable(std::string name, std::vector<SemanticClass> classes, std::uint32_t label_mask)
    : name_(std::move(name)), classes_(std::move(classes)), label_mask_(label_mask) {
  std::string faults;
  const auto fault = [&](const std::string& text) { faults += (faults.empty() ? "" : "; ") + text; };
  if (classes_.empty()) fault("it has no class");
  if (classes_.size() > kMaxClasses) fault("it has more than 254 classes");
  if (label_mask_ == 0) fault("its label_mask is 0, which leaves nothing of a label");

  index_of_id_.fill(-1);
  std::set<std::string> names;
  for (std::size_t i = 0; i < classes_.size(); ++i) {
    const SemanticClass& c = classes_[i];
    if (c.id >= kMaxClasses) fault("id " + std::to_string(c.id) + " is above 253");
    if (index_of_id_[c.id] >= 0) fault("id " + std::to_string(c.id) + " is given twice");
    index_of_id_[c.id] = static_cast<std::int16_t>(i);
    if (!names.insert(c.name).second) fault("name '" + c.name + "' is given twice");
    if (c.unlabelled && unlabelled_) fault("more than one class is flagged unlabelled");
    if (c.unlabelled) unlabelled_ = c.id;
    if (c.any_raw && any_raw_) fault("more than one class takes all other raw labels");
    if (c.any_raw) any_raw_ = c.id;
    if (c.cost < 0 || c.cost > 100) {
      fault("the cost of class '" + c.name + "' is " + std::to_string(c.cost) + " and must be 0 to 100");
    } else if (c.cost > 0 && !c.ground) {
      fault("class '" + c.name + "' has a cost, but not the flag ground: only ground has one");
    }
    for (const std::uint32_t raw : c.raw) {
      if (!class_of_raw_.emplace(raw, c.id).second) {
        fault("raw label " + std::to_string(raw) + " is given twice");
      }
      if (raw != kNoLabel && (raw & ~label_mask_) != 0) {
        fault("raw label " + std::to_string(raw) + " of class '" + c.name + "' has bits that label_mask " +
              hexText(label_mask_) + " leaves out");
      }
    }
  }
  constexpr std::uint32_t kSmall = 4096;
  for (const auto& [raw, id] : class_of_raw_) {
    if (raw >= kSmall) continue;
    if (class_of_small_raw_.size() <= raw) class_of_small_raw_.resize(raw + 1, -1);
    class_of_small_raw_[raw] = id;
  }
  if (!faults.empty()) throw std::invalid_argument("class table '" + name_ + "' is invalid: " + faults);
}

bool ClassTable::saysWhatMoves() const {
  return std::any_of(classes_.begin(), classes_.end(), [](const SemanticClass& c) { return c.dynamic; });
}

const SemanticClass* ClassTable::find(ClassId id) const {
  return index_of_id_[id] < 0 ? nullptr : &classes_[static_cast<std::size_t>(index_of_id_[id])];
}

const std::string& ClassTable::nameOf(ClassId id) const {
  static const std::string none;
  const SemanticClass* const found = find(id);
  return found ? found->name : none;
}

std::optional<ClassId> ClassTable::classOfRaw(std::uint32_t raw) const {
  if (raw != kNoLabel) raw &= label_mask_;
  if (raw < class_of_small_raw_.size()) {
    const std::int16_t id = class_of_small_raw_[raw];
    return id < 0 ? any_raw_ : static_cast<ClassId>(id);
  }
  const auto found = class_of_raw_.find(raw);
  if (found == class_of_raw_.end()) return any_raw_;
  return found->second;
}

std::optional<ClassId> ClassTable::classOf(std::uint32_t label, LabelValues values) const {
  if (values == LabelValues::kRaw) return classOfRaw(label);
  if (label == kNoLabel) return std::nullopt;
  for (const std::uint32_t id : {label, label & label_mask_}) {
    if (id < kMaxClasses && find(static_cast<ClassId>(id))) return static_cast<ClassId>(id);
  }
  return std::nullopt;
}

}  // namespace bki_mapping
