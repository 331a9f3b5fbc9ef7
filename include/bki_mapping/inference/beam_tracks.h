/// @file Beams as they cross slices of voxels.
#pragma once

#include <cstdint>
#include <vector>

#include "bki_mapping/core/config.h"
#include "bki_mapping/inference/beams.h"
#include "bki_mapping/inference/parallel_for.h"

namespace bki_mapping {

/// A beam runs along one axis most, its main axis; slices of voxels stand across that. In a slice, rows lie
/// one behind the other along the row axis, and a row's voxels, its lanes, along the lane axis.
constexpr int kLaneAxis[3] = {1, 0, 0}, kRowAxis[3] = {2, 2, 1};

/// Places in a slice are kept as whole numbers, too: so many are a voxel. With a kernel of up to
/// kMostTrackReach voxels what is computed with them stays below 256 voxels.
constexpr int kTrackBits = 23;
constexpr double kMostTrackReach = 72.0 * (1.0 + 1e-9);  ///< with room for rounding
constexpr std::int32_t kTrackVoxel = 1 << kTrackBits;

/// One beam. Lengths are in voxels where nothing else is said.
struct alignas(64) BeamTrack {
  double slope_lane, slope_row;      ///< steps from slice to slice
  double rho_slice;                  ///< change of rho from slice to slice
  std::int32_t step_lane, step_row;  ///< the slopes [1 / kTrackVoxel]
  /// A place in the slice at (lane, row) from the beam is off the beam's line by the length of (e_lane lane +
  /// e_row row, g_row row) [lengths of the kernel], and rho there is greater by rho_lane lane + rho_row row.
  float e_lane, e_row, g_row, rho_lane, rho_row;
  float half_lane, half_row;  ///< how far from the beam the kernel reaches along the lanes, and the rows
  std::int32_t axis;
};

/// The beams of a scan as arrays that inner loops read. Reading up to kBeamPadding past the last is allowed,
/// but for `tracks`.
struct BeamTrackArrays {
  const std::int32_t* axis;             ///< main axes
  const float *slope_lane, *slope_row;  ///< as in the tracks
  const float* end;                     ///< of the beam along its main axis, from the sensor [voxels]
  const BeamTrack* tracks;
};

/// The tracks of a scan's beams. Keeps its memory from scan to scan.
class BeamTracks {
 public:
  /// Replaces the beams. @param length of the kernel [m].
  /// @throws std::invalid_argument if that is more than 72 voxels.
  void set(const Beams& beams, double resolution, double length, Workers& workers);

  BeamTrackArrays arrays() const {
    return {axis_.data(), slope_lane_.data(), slope_row_.data(), end_.data(), tracks_.data()};
  }

 private:
  std::vector<std::int32_t> axis_;
  std::vector<float> slope_lane_, slope_row_, end_;
  std::vector<BeamTrack> tracks_;
};

}  // namespace bki_mapping
