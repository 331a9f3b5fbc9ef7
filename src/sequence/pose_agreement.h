/// @file Compares two readings of the poses of a sequence by how well its scans agree.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "bki_mapping/sequence/sequence.h"

namespace bki_mapping {

/// Mean distances from points of scans to the nearest points of earlier scans, cut at 0.5 m [m].
struct PoseAgreement {
  double as_given = 0.0, otherwise = 0.0;

  /// Whether the other reading of the poses leaves no doubt that it is the right one.
  bool otherIsBetter() const { return otherwise < 0.75 * as_given; }
};

/// Compares two readings of the poses of the same scans, on up to four pairs of scans between which the
/// readings differ by about a metre.
/// @param first, last half-open range of the scans. @return nullopt if the readings hardly differ anywhere,
/// as where the sensor rests. @throws std::runtime_error as Sequence::read.
std::optional<PoseAgreement> comparePoses(const Sequence& given, const Sequence& other, std::size_t first,
                                          std::size_t last);

/// What to say of a range of scans that agree much better when their poses are read as those of the other
/// sensor, with the remedy; "" if they do not, if the options say which sensor the poses are of, or if a scan
/// cannot be read, which is said when it is mapped.
/// @param first, last half-open range of the scans. @throws std::runtime_error as Sequence.
std::string poseWarning(const std::string& folder, SequenceOptions options, std::size_t first,
                        std::size_t last);

}  // namespace bki_mapping
