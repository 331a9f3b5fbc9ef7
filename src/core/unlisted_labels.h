/// @file Labels that a class table does not list.
#pragma once

#include <cstdint>
#include <map>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// Counts points whose label is not in the class table. Its memory is bounded, whatever labels come.
class UnlistedLabels {
 public:
  /// Number of different labels that are told apart.
  static constexpr std::size_t kMost = 64;

  /// @param label as the field has it: maybe negative; of colours, 0xRRGGBB.
  void add(std::int64_t label, std::size_t points = 1);
  /// Counts a point without a label: its field holds no number, no colour or no usable score.
  void addMissing() { ++missing_; }
  /// Notes that a field of single precision has rounded some of the labels.
  void noteRounding() { rounded_ = true; }
  UnlistedLabels& operator+=(const UnlistedLabels& other);

  /// The first kMost different labels, with their numbers of points.
  const std::map<std::int64_t, std::size_t>& counts() const { return counts_; }
  std::size_t missing() const { return missing_; }  ///< points without a label
  std::size_t others() const { return others_; }    ///< points with further labels
  bool rounded() const { return rounded_; }
  bool empty() const { return counts_.empty() && missing_ == 0; }

 private:
  std::map<std::int64_t, std::size_t> counts_;
  std::size_t missing_ = 0, others_ = 0;
  bool rounded_ = false;
};

/// The labels that the table does not list; kNoLabel counts as -1.
UnlistedLabels unlistedLabels(Span<const std::uint32_t> labels, const ClassTable& classes,
                              LabelValues values);

}  // namespace bki_mapping
