#include "bki_mapping/inference/beam_tracks.h"

#include <cmath>
#include <stdexcept>

#include "bki_mapping/inference/beam_cells.h"
#include "bki_mapping/inference/chunks.h"

namespace bki_mapping {
namespace {

constexpr float kShortest = 1e-9f;  ///< [m]

int mainAxis(const Eigen::Vector3f& beam) {
  const Eigen::Vector3f size = beam.cwiseAbs();
  const int of_two = size.y() > size.x() ? 1 : 0;
  return size.z() > size[of_two] ? 2 : of_two;
}

/// With w the beam's unit direction within the slice, a place at p from the beam is off its line by d^2 =
/// |p|^2 - (w p)^2; the factors of that form by Cholesky, lane first, are e and g. Slopes are multiplied by
/// the size of a box, and therefore in double precision. @param reach of the kernel [voxels].
BeamTrack trackOf(const Eigen::Vector3f& beam, int axis, double resolution, float reach) {
  const double lane = static_cast<double>(beam[kLaneAxis[axis]]),
               row = static_cast<double>(beam[kRowAxis[axis]]);
  const double inverse = 1.0 / static_cast<double>(beam[axis]);
  BeamTrack track;
  track.slope_lane = lane * inverse;
  track.slope_row = row * inverse;
  track.rho_slice = resolution * inverse;
  const auto steps = [](double slope) {
    return static_cast<std::int32_t>(slope * kTrackVoxel + std::copysign(0.5, slope));  // rounded
  };
  track.step_lane = steps(track.slope_lane);
  track.step_row = steps(track.slope_row);

  const auto s = static_cast<float>(track.slope_lane), t = static_cast<float>(track.slope_row);
  const float lane_slant = std::sqrt(1.0f + s * s), row_slant = std::sqrt(1.0f + t * t);
  const float u = 1.0f / std::sqrt(1.0f + s * s + t * t);  // of the unit direction, along the main axis
  const float inverse_slant = 1.0f / row_slant, inverse_reach = 1.0f / reach;
  track.e_lane = u * row_slant * inverse_reach;
  track.e_row = -s * t * u * inverse_slant * inverse_reach;
  track.g_row = inverse_slant * inverse_reach;
  const float rho = static_cast<float>(track.rho_slice) * u * u;
  track.rho_lane = s * rho;
  track.rho_row = t * rho;
  track.half_lane = reach * lane_slant;
  track.half_row = reach * row_slant;
  track.axis = axis;
  return track;
}

}  // namespace

void BeamTracks::set(const Beams& beams, double resolution, double length, Workers& workers) {
  const std::size_t count = beams.ends.size(), padded = count + kBeamPadding;
  axis_.resize(padded, 0);
  for (auto* each : {&slope_lane_, &slope_row_, &end_}) each->resize(padded, 0.0f);
  tracks_.resize(count);
  if (length > kMostTrackReach * resolution) {
    throw std::invalid_argument("a kernel of more than 72 voxels is too long for lines");
  }
  const auto per_metre = static_cast<float>(1.0 / resolution),
             reach = static_cast<float>(length / resolution);
  const Chunks chunks(count);
  workers.forEach(chunks.count(), [&](std::size_t c, std::size_t) {
    for (std::size_t b = chunks.begin(c); b < chunks.end(c); ++b) {
      const Eigen::Vector3f& beam = beams.ends[b];
      const int axis = mainAxis(beam);
      // A beam without length has no direction, and reaches nothing: all is 0, rho everywhere.
      const BeamTrack track =
          std::abs(beam[axis]) < kShortest ? BeamTrack{} : trackOf(beam, axis, resolution, reach);
      tracks_[b] = track;
      axis_[b] = axis;
      slope_lane_[b] = static_cast<float>(track.slope_lane);
      slope_row_[b] = static_cast<float>(track.slope_row);
      end_[b] = beam[axis] * per_metre;
    }
  });
}

}  // namespace bki_mapping
