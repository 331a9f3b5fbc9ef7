/// @file Class tables, and sets of classes.
#pragma once

#include <array>
#include <bitset>
#include <initializer_list>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// How the labels of a scan are encoded: raw labels of the data set, or ids of the class table.
enum class LabelValues { kRaw, kId };

/// The label of a point without one: -1, as signed fields have it, or no number at all. It has no bits for
/// ClassTable::labelMask(): a table may list it as the raw label 4294967295.
constexpr std::uint32_t kNoLabel = 0xffffffffu;

/// One class of the table.
struct SemanticClass {
  ClassId id = 0;                       ///< unique in the table, 0 to 253
  std::string name;                     ///< unique in the table
  std::array<std::uint8_t, 3> color{};  ///< red, green, blue
  std::vector<std::uint32_t> raw;       ///< labels of the data set that mean this class
  bool any_raw = false;                 ///< takes all labels that no class lists; at most one class has this
  bool unlabelled = false;              ///< given to hits of unknown class; at most one class has this
  bool dynamic = false;                 ///< objects of this class can move
  bool ground = false;                  ///< robots can drive on it
  bool ignored = false;                 ///< navigation ignores it: it is neither ground nor an obstacle
  std::optional<double> free_gain;      ///< replaces the gain of the mapper's settings, > 0
  /// Rain, snow, fog, dust: never occupies, and its beams clear up to it. Map files do not store it.
  bool airborne = false;
  bool living = false;  ///< people, riders, animals: `dynamic`, but never parked
  /// Cost of driving on it, as nav_msgs/OccupancyGrid counts: 0, freely, to 100, never. Above 0 only with
  /// `ground`. Belongs to the vehicle, not to the map: map files do not store it.
  int cost = 0;
};

/// Maps the labels of clouds to classes. Immutable.
class ClassTable {
 public:
  /// A label_mask with which all bits of a label are the class.
  static constexpr std::uint32_t kAllBits = 0xffffffffu;

  /// @param label_mask which bits of a label are the class; the others may hold an instance.
  /// @throws std::invalid_argument that lists every fault: no class, more than 254 classes, a duplicate id,
  /// name or raw label, an id above 253, more than one unlabelled or catch-all class, a cost that is not
  /// allowed, a mask without bits, a raw label with bits outside the mask.
  ClassTable(std::string name, std::vector<SemanticClass> classes, std::uint32_t label_mask = kAllBits);

  const std::string& name() const { return name_; }
  std::uint32_t labelMask() const { return label_mask_; }
  const std::vector<SemanticClass>& classes() const { return classes_; }
  std::size_t size() const { return classes_.size(); }

  /// The class with this id; nullptr if the table has none, as for kFreeClass.
  const SemanticClass* find(ClassId id) const;
  /// The name of a class; "" if the table has none, as for kFreeClass.
  const std::string& nameOf(ClassId id) const;
  /// The class of a raw label, of which the bits of labelMask() count; no value if the table neither lists it
  /// nor has a catch-all class.
  std::optional<ClassId> classOfRaw(std::uint32_t raw) const;
  /// The class of a label; no value if the table has none for it. An id may have bits outside of labelMask(),
  /// too.
  std::optional<ClassId> classOf(std::uint32_t label, LabelValues values) const;
  /// The class of hits whose class is unknown; no value if no class has the flag.
  std::optional<ClassId> unlabelled() const { return unlabelled_; }
  /// Whether any class has the flag dynamic; otherwise the table does not say what can move.
  bool saysWhatMoves() const;

 private:
  std::string name_;
  std::vector<SemanticClass> classes_;
  std::uint32_t label_mask_;
  std::array<std::int16_t, 256> index_of_id_;  ///< in classes_; -1 for unused ids
  std::unordered_map<std::uint32_t, ClassId> class_of_raw_;
  std::vector<std::int16_t> class_of_small_raw_;  ///< faster lookup of small raw labels; -1 if not listed
  std::optional<ClassId> unlabelled_;
  std::optional<ClassId> any_raw_;
};

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
