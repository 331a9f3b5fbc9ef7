/// @file Which beams pass near a place: retrieval on the sphere of directions about the sensor.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "bki_mapping/core/config.h"

namespace bki_mapping {

/// Beams first to before last of a list.
struct BeamRange {
  std::uint32_t first, last;
};

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

/// The order in which beams must be listed for makeBeamIndex: by elevation row, then azimuth column, of
/// BeamTable.
/// @param directions unit vectors. @return numbers of the directions, first to last.
std::vector<std::uint32_t> sortedByDirection(const std::vector<Eigen::Vector3f>& directions);

/// @param directions unit vectors, one a beam, in the order of sortedByDirection.
std::unique_ptr<BeamIndex> makeBeamIndex(BeamIndexType type, const std::vector<Eigen::Vector3f>& directions);

/// Beams bucketed by elevation and azimuth; a query names a few contiguous slices.
class BeamTable : public BeamIndex {
 public:
  explicit BeamTable(const std::vector<Eigen::Vector3f>& directions);
  void query(const Eigen::Vector3f& centre, float radius, std::vector<BeamRange>& ranges) const override;

 private:
  void appendCells(int row, int first_column, int last_column, std::vector<BeamRange>& ranges) const;

  std::vector<std::uint32_t> begin_;  ///< of each cell's beams, row by row; one more than cells
};

}  // namespace bki_mapping
