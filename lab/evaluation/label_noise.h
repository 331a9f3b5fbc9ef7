/// @file Wrong labels, to measure how well a map copes with them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"

namespace bki_mapping {

/// Which labels are wrong, and what they say. "Similar" classes have the same flags `dynamic` and `ground`:
/// vehicles, riders and persons are similar, and so are poles, trunks and walls.
enum class LabelErrors {
  kEven,     ///< any label; any other class
  kSimilar,  ///< any label; a similar class
  kObjects,  ///< all labels of a class within a cube of 2 m, for object_seconds; a similar class
  kBorders,  ///< labels of points within a cube of 0.5 m in which there are several classes; one of these
  kFar,  ///< any label, the more often the farther: at 20 m with the probability asked for; a similar class
  kNetwork,  ///< as networks err: kObjects with half the probability; else kBorders; else kFar with half of
             ///< it
};
/// "even", "similar", "objects", "borders", "far" or "network". @throws std::invalid_argument for another
/// name.
LabelErrors labelErrorsNamed(const std::string& name);

struct LabelNoise {
  double rate = 0.0;  ///< probability of an error, 0 to 1
  LabelErrors errors = LabelErrors::kEven;
  std::uint64_t seed = 1;
  double object_seconds = 1.0;  ///< how long an object keeps its wrong label, at least 0.001 [s]
};

/// The labels of a scan with errors. Equal seeds, stamps and scans give equal labels.
std::vector<std::uint32_t> withLabelNoise(const Scan& scan, const ClassTable& classes,
                                          const LabelNoise& noise);

}  // namespace bki_mapping
