/// @file Indexes of beams by direction, which find the beams that pass near a point.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "beams/beam_cells.h"
#include "bki_mapping/beams/beam_config.h"

namespace bki_mapping {

/// Finds beams by direction. It treats beams as half-lines from the sensor; callers check their ends.
class BeamIndex {
 public:
  virtual ~BeamIndex() = default;

  /// Finds all half-lines that pass through a ball about `centre`, and few others.
  /// @param centre relative to the sensor [m]. @param radius [m], > 0.
  /// @param[out] ranges of these beams, disjoint and in unspecified order.
  virtual void query(const Eigen::Vector3f& centre, float radius, std::vector<BeamRange>& ranges) const = 0;
};

/// Beams sorted by direction bin; a query returns a few ranges. Keeps its memory from scan to scan.
class BeamTable : public BeamIndex {
 public:
  /// The direction bin of a vector. @param v of any length.
  static std::uint32_t cellOf(const Eigen::Vector3f& v) {
    const float length = v.norm(), sine = length > 0.0f ? v.z() / length : 0.0f;
    return static_cast<std::uint32_t>(beamRow(sine) * kBeamColumns + beamColumn(pseudoAngle(v.x(), v.y())));
  }

  /// Replaces the beams.
  /// @param cells direction bin of each beam. @param[out] order the beams, as offsets in `cells`, sorted by
  /// bin. Queries return ranges of `order`.
  void build(const std::vector<std::uint32_t>& cells, std::vector<std::uint32_t>& order);

  void query(const Eigen::Vector3f& centre, float radius, std::vector<BeamRange>& ranges) const override;
  /// The same for the half-lines that pass through a box. @param box relative to the sensor [m].
  void query(const Eigen::AlignedBox3d& box, std::vector<BeamRange>& ranges) const;
  /// Most ranges of a query: two in each row if it crosses the seam.
  static constexpr std::size_t kMostRanges = 2 * kBeamRows;

  /// Offset in `order` of each bin's first beam, row by row; one element more than bins.
  const std::vector<std::uint32_t>& begin() const { return begin_; }

 private:
  /// The columns from `first` on, counterclockwise, to `last`, which may be across the seam.
  struct Columns {
    int first, last;
  };
  void listCells(int first_row, int last_row, const Columns& columns, std::vector<BeamRange>& ranges) const;
  void appendCells(int row, int first_column, int last_column, std::vector<BeamRange>& ranges) const;

  std::vector<std::uint32_t> begin_;
};

/// An R-tree (Boost.Geometry) of unit direction vectors, which have neither seam nor pole. It is the paper's
/// index, and the table is tested against it. @param directions unit vectors, one for each beam.
std::unique_ptr<BeamIndex> makeBeamRtree(const std::vector<Eigen::Vector3f>& directions);

}  // namespace bki_mapping
