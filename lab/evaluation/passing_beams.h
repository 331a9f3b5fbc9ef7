/// @file Tells whether beams of a scan pass near a point.
#pragma once

#include <cstdint>
#include <vector>

#include "beams/beam_index.h"
#include "bki_mapping/core/scan.h"

namespace bki_mapping {

/// The beams of one scan, by direction. Keeps its memory from scan to scan.
class PassingBeams {
 public:
  /// Replaces the beams by those of a scan. Skips points that are not finite, or at the sensor.
  void build(const Scan& scan) {
    origin_ = scan.origin;
    ends_.clear();
    cells_.clear();
    for (const Eigen::Vector3f& end : scan.points) {
      if (!end.allFinite() || end.isZero()) continue;
      ends_.push_back(end);
      cells_.push_back(BeamTable::cellOf(end));
    }
    table_.build(cells_, order_);
  }

  /// Whether a beam passes within `radius` of a point, which is beside the beam and not beyond its end.
  /// @param point map frame [m].
  bool anyPasses(const Eigen::Vector3d& point, double radius) {
    const Eigen::Vector3f to = (point - origin_).cast<float>();
    const auto reach = static_cast<float>(radius);
    ranges_.clear();
    table_.query(to, reach, ranges_);
    for (const BeamRange& range : ranges_) {
      for (std::uint32_t n = range.first; n < range.last; ++n) {
        const Eigen::Vector3f& end = ends_[order_[n]];
        const float rho = to.dot(end) / end.squaredNorm();
        if (rho > 0.0f && rho < 1.0f && (to - rho * end).squaredNorm() < reach * reach) return true;
      }
    }
    return false;
  }

 private:
  Eigen::Vector3d origin_;
  std::vector<Eigen::Vector3f> ends_;
  std::vector<std::uint32_t> cells_, order_;
  std::vector<BeamRange> ranges_;
  BeamTable table_;
};

}  // namespace bki_mapping
