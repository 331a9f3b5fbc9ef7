/// @file Which beams pass near a place: retrieval on the sphere of directions about the sensor.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "beams/beam_cells.h"
#include "bki_mapping/beams/beam_config.h"

namespace bki_mapping {

/// Finds beams by direction. Beams are half-lines from the sensor here; where they end is the caller's
/// matter.
class BeamIndex {
 public:
  virtual ~BeamIndex() = default;

  /// Finds the half-lines that may pass through a ball about `centre`: all that do, and few others.
  /// @param centre relative to the sensor [m]. @param radius [m], > 0.
  /// @param[out] ranges of their numbers, each number once, in no promised order.
  virtual void query(const Eigen::Vector3f& centre, float radius, std::vector<BeamRange>& ranges) const = 0;
};

/// Beams bucketed by elevation and azimuth; a query names a few contiguous slices. Keeps its memory from scan
/// to scan.
class BeamTable : public BeamIndex {
 public:
  /// The cell of a direction. @param v of any length.
  static std::uint32_t cellOf(const Eigen::Vector3f& v) {
    const float length = v.norm(), sine = length > 0.0f ? v.z() / length : 0.0f;
    return static_cast<std::uint32_t>(beamRow(sine) * kBeamColumns + beamColumn(pseudoAngle(v.x(), v.y())));
  }

  /// Replaces the beams.
  /// @param cells of all beams. @param[out] order their numbers, sorted by cell: what a query's numbers
  /// count.
  void build(const std::vector<std::uint32_t>& cells, std::vector<std::uint32_t>& order);

  void query(const Eigen::Vector3f& centre, float radius, std::vector<BeamRange>& ranges) const override;
  /// A query names at most this many ranges: two in each row, where it crosses the seam.
  static constexpr std::size_t kMostRanges = 2 * kBeamRows;

  /// Of each cell's beams in the order, row by row; one more than cells.
  const std::vector<std::uint32_t>& begin() const { return begin_; }

 private:
  void appendCells(int row, int first_column, int last_column, std::vector<BeamRange>& ranges) const;

  std::vector<std::uint32_t> begin_;
};

/// The same from an R-tree (Boost.Geometry) over unit direction vectors, which has neither seam nor pole:
/// what the table is tested against.
/// @param directions unit vectors, one a beam.
std::unique_ptr<BeamIndex> makeBeamRtree(const std::vector<Eigen::Vector3f>& directions);

}  // namespace bki_mapping
