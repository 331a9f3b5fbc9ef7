/// @file The classes of a data set, known at run time.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// What the labels of a scan are: the data set's raw numbers, or ids of the class table.
enum class LabelValues { kRaw, kId };

/// One class of the table.
struct SemanticClass {
  ClassId id = 0;                       ///< unique in the table, 0 to 253
  std::string name;                     ///< unique in the table
  std::array<std::uint8_t, 3> color{};  ///< red, green, blue
  std::vector<std::uint32_t> raw;       ///< label numbers in the data set that mean this class
  bool any_raw = false;     ///< means all label numbers that no class lists; at most one class has this
  bool unlabelled = false;  ///< hits of no known class; at most one class has this
  bool dynamic = false;     ///< things of this class can move
  bool ground = false;      ///< robots stand and drive on it
  bool ignored = false;     ///< of no account for navigation: neither ground nor in the way
  std::optional<double> free_gain;  ///< instead of the gain of the mapper's settings, > 0
};

/// Maps label numbers of clouds to classes. Immutable.
class ClassTable {
 public:
  /// @throws std::invalid_argument that lists every fault: no class, more than 254, an id, name or raw
  /// number given twice, an id above 253, two unlabelled or catch-all classes.
  ClassTable(std::string name, std::vector<SemanticClass> classes);

  const std::string& name() const { return name_; }
  const std::vector<SemanticClass>& classes() const { return classes_; }
  std::size_t size() const { return classes_.size(); }

  /// The class with an id; nullptr where the table has none (so for kFreeClass).
  const SemanticClass* find(ClassId id) const;
  /// The class of a raw label number; none where the table does not list it.
  std::optional<ClassId> classOfRaw(std::uint32_t raw) const;
  /// The class of a label of a cloud; none where the table does not list it.
  std::optional<ClassId> classOf(std::uint32_t label, LabelValues values) const;
  /// The class of hits without a known class; none where the table has no such class.
  std::optional<ClassId> unlabelled() const { return unlabelled_; }

 private:
  std::string name_;
  std::vector<SemanticClass> classes_;
  std::array<std::int16_t, 256> place_of_id_;
  std::unordered_map<std::uint32_t, ClassId> class_of_raw_;
  std::vector<std::int16_t> class_of_small_raw_;  ///< the same of numbers below its size; -1 for none
  std::optional<ClassId> unlabelled_;
  std::optional<ClassId> any_raw_;
};

}  // namespace bki_mapping
