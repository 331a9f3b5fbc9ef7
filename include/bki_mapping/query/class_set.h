/// @file Sets of classes, for filters.
#pragma once

#include <bitset>
#include <initializer_list>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"

namespace bki_mapping {

/// A set of classes by their ids.
class ClassSet {
 public:
  /// No class.
  ClassSet() = default;
  /// @throws std::invalid_argument if an id is above 253.
  ClassSet(std::initializer_list<ClassId> ids) {
    for (const ClassId id : ids) insert(id);
  }
  /// All classes that a table can have.
  static ClassSet all();
  /// The classes of these names. @throws std::invalid_argument that names those that the table lacks.
  static ClassSet of(const ClassTable& table, const std::vector<std::string>& names);
  /// All classes but these: "anything but ground".
  static ClassSet allBut(const ClassSet& others);

  /// @throws std::invalid_argument if the id is above 253.
  void insert(ClassId id);
  /// @param id also kFreeClass, which is never in a set.
  bool contains(ClassId id) const { return ids_[id]; }
  /// Whether the sets have a class in common.
  bool intersects(const ClassSet& other) const { return (ids_ & other.ids_).any(); }
  std::size_t size() const { return ids_.count(); }
  bool empty() const { return ids_.none(); }
  /// The ids, rising.
  std::vector<ClassId> ids() const;

  bool operator==(const ClassSet& other) const { return ids_ == other.ids_; }
  bool operator!=(const ClassSet& other) const { return ids_ != other.ids_; }

 private:
  std::bitset<256> ids_;
};

}  // namespace bki_mapping
