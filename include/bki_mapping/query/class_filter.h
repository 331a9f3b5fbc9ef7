/// @file Sets of classes, for filters.
#pragma once

#include <bitset>
#include <initializer_list>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"

namespace bki_mapping {

/// A set of classes by their ids.
class ClassFilter {
 public:
  /// No class.
  ClassFilter() = default;
  /// @throws std::invalid_argument if an id is above 253.
  ClassFilter(std::initializer_list<ClassId> ids) {
    for (const ClassId id : ids) insert(id);
  }
  /// All classes that a table can have.
  static ClassFilter all();
  /// The classes of these names. @throws std::invalid_argument that names those that the table lacks.
  static ClassFilter of(const ClassTable& table, const std::vector<std::string>& names);
  /// All classes but these: "anything but ground".
  static ClassFilter allBut(const ClassFilter& others);

  /// @throws std::invalid_argument if the id is above 253.
  void insert(ClassId id);
  /// @param id also kFreeClass, which is never in a set.
  bool contains(ClassId id) const { return ids_[id]; }
  /// Whether the sets have a class in common.
  bool intersects(const ClassFilter& other) const { return (ids_ & other.ids_).any(); }
  std::size_t size() const { return ids_.count(); }
  bool empty() const { return ids_.none(); }
  /// The ids, rising.
  std::vector<ClassId> ids() const;

  bool operator==(const ClassFilter& other) const { return ids_ == other.ids_; }
  bool operator!=(const ClassFilter& other) const { return ids_ != other.ids_; }

 private:
  std::bitset<256> ids_;
};

}  // namespace bki_mapping
