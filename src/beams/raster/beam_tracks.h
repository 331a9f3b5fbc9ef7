/// @file Beams as they cross slices of voxels.
#pragma once

#include <cstdint>
#include <vector>

#include "beams/beams.h"
#include "beams/raster/beam_slicing.h"
#include "parallel/thread_pool.h"

namespace bki_mapping {

/// Places in a slice are kept as whole numbers, too: so many are a voxel. With a kernel of up to
/// kMostTrackReach voxels what is computed with them stays below 256 voxels.
constexpr int kTrackBits = 23;
constexpr double kMostTrackReach = 72.0 * (1.0 + 1e-9);  ///< with room for rounding
constexpr std::int32_t kTrackVoxel = 1 << kTrackBits;

/// From here on to its end at r = 1 the sparse kernel is below 1.1e-7, and is left out.
constexpr double kReachThatCounts = 0.974;

/// One beam in its slices. Lengths are in voxels where nothing else is said, `side` is counted in columns.
struct alignas(64) BeamTrack {
  double slope_side, slope_height;      ///< steps from slice to slice
  std::int32_t step_side, step_height;  ///< the slopes [1 / kTrackVoxel]
  /// A place in the slice at (side, height) from the beam is off the beam's line by the length of the vector
  /// (e_side side + e_height height, g_height height) [lengths of the kernel / InnerLoops' kernel_unit], and
  /// rho there is greater by rho_side side + rho_height height.
  float e_side, e_height, g_height, rho_side, rho_height;
  float rho_slice;               ///< change of rho from slice to slice
  float half_side, half_height;  ///< how far from the beam the kernel reaches in a slice, as far as it counts
  std::int32_t slicing;          ///< as BeamSlicing numbers them
};

/// The beams of a scan as arrays that inner loops read. Reading up to kBeamPadding past the last is allowed,
/// but for `tracks`.
struct BeamTrackArrays {
  const std::int32_t* axis;                ///< main axes
  const float *slope_side, *slope_height;  ///< along the side and height axes, by step along the main axis
  const float* end;                        ///< of the beam along its main axis, from the sensor [voxels]
  const float* skew;                       ///< of the slices
  const BeamTrack* tracks;
};

/// The same, to be written.
struct BeamTrackTargets {
  std::int32_t* axis;
  float *slope_side, *slope_height, *end, *skew;
  BeamTrack* tracks;
};

struct InnerLoops;

/// The tracks of a scan's beams. Keeps its memory from scan to scan.
class BeamTracks {
 public:
  /// Replaces the beams. @param length of the kernel [m]. @param loops that will read them, too.
  /// @throws std::invalid_argument if that is more than 72 voxels.
  void set(const Beams& beams, double resolution, double length, const InnerLoops& loops, ThreadPool& pool);

  BeamTrackArrays arrays() const {
    return {axis_.data(), slope_side_.data(), slope_height_.data(),
            end_.data(),  skew_.data(),       tracks_.data()};
  }

 private:
  std::vector<std::int32_t> axis_;
  std::vector<float> slope_side_, slope_height_, end_, skew_;
  std::vector<BeamTrack> tracks_;
};

}  // namespace bki_mapping
