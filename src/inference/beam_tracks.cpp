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

/// How a beam runs by step along its main axis.
struct Course {
  double side, height;  ///< slopes
  double rho;           ///< change of rho
};

/// In skew slices, where one column of each and two voxels of that hold the kernel; else in straight ones.
/// @param reach of the kernel [voxels]. @param unit by which e and g are multiplied.
///
/// Let v lead from a slice's column to the next, n stand across slices (v = (0, 1), n = (1, 0) in straight
/// ones, v = (1, -2 skew), n = (2, skew) in skew ones, along the main and side axes), h along columns, u be
/// the unit direction. A place at p = a v + b h is off the line by d^2 = |p|^2 - (u p)^2 = A a^2 + 2 B a b +
/// C b^2, whose determinant is A C - B^2 = (u n)^2; its factors by Cholesky, a first, are e and g. Slopes are
/// multiplied by the size of a box, and therefore in double precision.
BeamTrack trackOf(const Course& course, int axis, float reach, float unit) {
  const auto s = static_cast<float>(course.side), t = static_cast<float>(course.height);
  const float counts = reach * static_cast<float>(kReachThatCounts), limit = 1.0f / (counts * counts);
  const float side = 1.0f + s * s, skew_slices = 2.0f + std::abs(s), squared = skew_slices * skew_slices;
  const bool is_skew = squared + 5.0f * t * t <= squared * limit;  // half_side is below 0.5 then, too

  const double slices = is_skew ? 2.0 + std::abs(course.side) : 1.0;  // by step along the main axis
  const double by_slice = 1.0 / slices;
  BeamTrack track;
  track.slicing = BeamSlicing{axis, !is_skew ? 0 : course.side < 0.0 ? -1 : 1}.number();
  track.slope_side = (is_skew ? 1.0 : course.side) * by_slice;
  track.slope_height = course.height * by_slice;
  track.rho_slice = static_cast<float>(course.rho * by_slice);
  const auto steps = [](double slope) {
    return static_cast<std::int32_t>(slope * kTrackVoxel + std::copysign(0.5, slope));  // rounded
  };
  track.step_side = steps(track.slope_side);
  track.step_height = steps(track.slope_height);

  const float uu = 1.0f / (side + t * t);                         // u along the main axis, squared
  const float v_along = is_skew ? 1.0f - 2.0f * std::abs(s) : s;  // u v is that times u
  const float across = is_skew ? squared : 1.0f;                  // (u n)^2 is that times u^2
  const float a = (is_skew ? 5.0f : 1.0f) - uu * v_along * v_along, by_a = 1.0f / a, by_reach = unit / reach;
  track.e_side = std::sqrt(a) * by_reach;
  track.e_height = -uu * v_along * t * by_a * track.e_side;
  track.g_height = std::sqrt(uu * across * by_a) * by_reach;
  const float rho = static_cast<float>(course.rho) * uu;
  track.rho_side = v_along * rho;
  track.rho_height = t * rho;
  track.half_side = is_skew ? 0.5f : counts * std::sqrt(side);
  track.half_height = is_skew ? 1.0f : counts * std::sqrt(1.0f + t * t);
  return track;
}

}  // namespace

void BeamTracks::set(const Beams& beams, double resolution, double length, float unit, Workers& workers) {
  const std::size_t count = beams.ends.size(), padded = count + kBeamPadding;
  axis_.resize(padded, 0);
  for (auto* each : {&slope_side_, &slope_height_, &end_, &skew_}) each->resize(padded, 0.0f);
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
      Course course = {};
      BeamTrack track = {};
      if (std::abs(beam[axis]) >= kShortest) {
        const double inverse = 1.0 / static_cast<double>(beam[axis]);
        course = {static_cast<double>(beam[kSideAxis[axis]]) * inverse,
                  static_cast<double>(beam[kHeightAxis[axis]]) * inverse, resolution * inverse};
        track = trackOf(course, axis, reach, unit);
      }
      tracks_[b] = track;
      axis_[b] = axis;
      slope_side_[b] = static_cast<float>(course.side);
      slope_height_[b] = static_cast<float>(course.height);
      skew_[b] = static_cast<float>(BeamSlicing::of(track.slicing).skew);
      end_[b] = beam[axis] * per_metre;
    }
  });
}

}  // namespace bki_mapping
