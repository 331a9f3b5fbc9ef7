/// @file The evidence of a tile as multiples of what scans add. docs/map_file.md specifies the format.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "bki_mapping/rules/rules_config.h"

namespace bki_mapping {

/// Evidence is n a + m b + a rest [units], modulo 2^32.
struct EvidenceSteps {
  std::uint32_t a = 0, b = 0;  ///< 0: not used
};

/// The evidence of a tile, other than 0, in sections that can be compressed further than the numbers
/// themselves. Planes of `free` and those of the other classes have steps of their own.
class EvidenceSections {
 public:
  enum Kind : std::size_t { kFree, kOther, kKinds };
  /// A plane with evidence in so many voxels.
  struct Plane {
    Kind kind;
    std::size_t values;
  };
  using Planes = std::vector<Plane>;
  using Values = std::vector<std::uint32_t>;  ///< plane after plane
  using StepsOfKinds = std::array<EvidenceSteps, kKinds>;

  /// Of each kind: four bytes, the lowest first, of n, of m, and of the rest. Those of n and m are
  /// differences from the value before.
  static constexpr std::size_t kOfKind = 12, kSections = kKinds * kOfKind;
  static constexpr Kind kindOf(std::size_t section) { return section < kOfKind ? kFree : kOther; }

  /// What scans add where the rules apply.
  static StepsOfKinds stepsOf(const RulesConfig& rules);
  /// Of the steps those that fit the values, and 0 instead of the others.
  static StepsOfKinds fittingOf(StepsOfKinds steps, const Planes& planes, const Values& values);
  /// @param[out] sections kSections of them; one whose bytes are all 0 is empty.
  static void split(const Planes& planes, const Values& values, const StepsOfKinds& steps,
                    std::string* sections);
  /// Adds what a section holds to values. @param section number. @param bytes as many as there are values of
  /// its kind.
  static void add(std::size_t section, const std::string& bytes, const Planes& planes,
                  const StepsOfKinds& steps, Values& values);
  static std::size_t count(const Planes& planes, Kind kind);
};

}  // namespace bki_mapping
