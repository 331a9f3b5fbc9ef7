/// @file Beams of a short kernel, added to the few voxels about their places; included by trace_loop.h alone.
///
/// In a slice a beam is between 2 x 2 voxels. It is added to these where its kernel reaches up to 1 voxel,
/// else to one more on each side. Lanes are these voxels, of as many slices as there is room for.
#pragma once

#include "bki_mapping/inference/group_sums.h"
#include "lane_kernel.h"
#include "lane_weight.h"
#include "lanes.h"
#include "traced_beam.h"

namespace bki_mapping {
namespace {

/// Lanes are divided by four: two voxels of two rows, or four of one.
constexpr int kQuad = 4, kQuads = kLanes / kQuad;

/// What the lanes stand for, with kRows rows of kAcross voxels in a slice.
template <int kRows, int kAcross>
struct ThinShape {
  static constexpr int kOfSlice = kRows * kAcross / kQuad;                    ///< quads
  static constexpr int kSlices = kOfSlice < kQuads ? kQuads / kOfSlice : 1;   ///< at a time
  static constexpr int kVectors = kOfSlice < kQuads ? 1 : kOfSlice / kQuads;  ///< at a time
  static constexpr int kRowsOfQuad = kQuad / kAcross;

  // Voxels and rows are counted from that before the beam's place.
  static constexpr int kFirst = 1 - kAcross / 2;  ///< voxel of a row
  /// The first row of a slice's n-th quad.
  static constexpr int rowOf(int n) { return n * kRowsOfQuad + 1 - kRows / 2; }

  /// Of each lane: its voxel, and one more; its slice.
  FloatLanes lane, row[kVectors], slice;
  IntLanes in_slice[kSlices];  ///< all bits set in the lanes of each slice

  ThinShape() {
    for (int n = 0; n < kLanes; ++n) {
      const int of = kSlices == 1 ? 0 : n / kQuad / kOfSlice, in_quad = n % kQuad;
      lane[n] = static_cast<float>(kFirst + in_quad % kAcross + 1);
      slice[n] = static_cast<float>(of);
      for (int v = 0; v < kVectors; ++v) {
        row[v][n] = static_cast<float>(rowOf((v * kQuads + n / kQuad) % kOfSlice) + in_quad / kAcross + 1);
      }
      for (int s = 0; s < kSlices; ++s) in_slice[s][n] = of == s ? -1 : 0;
    }
  }
};

/// Row and lane of a beam in a slice [1 / kTrackVoxel], from voxel (-kPad, -kPad) on, both in one number: the
/// row stands in the upper half.
class ThinPlace {
 public:
  ThinPlace(std::int64_t lane, std::int64_t row, const BeamTrack& track)
      : place_(join(lane, row)), step_(join(track.step_lane, track.step_row)) {}

  std::int32_t lane() const { return static_cast<std::int32_t>(place_); }
  std::int32_t row() const { return static_cast<std::int32_t>(place_ >> 32); }
  /// The number in the slice of the voxel before it.
  [[gnu::always_inline]] std::uint64_t voxel() const {
    static_assert(GroupSums::kRow == 64);
#if defined(__BMI2__)
    constexpr std::uint64_t kWhole = std::uint64_t{63} << kTrackBits;
    return _pext_u64(place_, kWhole << 32 | kWhole);
#else
    return (place_ >> (32 + kTrackBits)) * 64 + (place_ >> kTrackBits & 63);
#endif
  }
  [[gnu::always_inline]] void toNextSlice() {
    place_ += step_;
  }

 private:
  static std::uint64_t join(std::int64_t lane, std::int64_t row) {
    return (static_cast<std::uint64_t>(row) << 32) + static_cast<std::uint64_t>(lane);
  }

  std::uint64_t place_, step_;
};

/// The fraction of a place in voxels, and 1: in [1, 2), without rounding.
[[gnu::always_inline]] inline FloatLanes fractionAndOne(IntLanes place) {
  static_assert(kTrackBits == 23, "the bits of a float's fraction");
  return reinterpret_cast<FloatLanes>((place & (kTrackVoxel - 1)) | 0x3f800000);
}

/// Adds a beam in the slices of its pass, and up to kSlices - 1 behind. @param at the first of them.
template <BeamWeight kWeight, typename Shape>
[[gnu::always_inline]] inline void addThin(const TracedBeam& beam, ThinPlace place, int slices,
                                           const Shape& shape, const LaneKernel& kernel, float* at) {
  constexpr int kSlices = Shape::kSlices, kVectors = Shape::kVectors;
  IntLanes lane = IntLanes{} + place.lane(), row = IntLanes{} + place.row();
  for (int s = 1; s < kSlices; ++s) {
    lane += shape.in_slice[s] & (s * beam.step_lane);
    row += shape.in_slice[s] & (s * beam.step_row);
  }
  FloatLanes e[kVectors], g[kVectors], rho[kVectors];
  for (int v = 0; v < kVectors; ++v) {
    e[v] = shape.lane * beam.e_lane + shape.row[v] * beam.e_row;
    g[v] = shape.row[v] * beam.g_row;
    rho[v] =
        beam.rho + shape.slice * beam.rho_slice + shape.lane * beam.rho_lane + shape.row[v] * beam.rho_row;
  }
  for (int slice = 0; slice < slices; slice += kSlices) {
    const FloatLanes l = fractionAndOne(lane), r = fractionAndOne(row);
    FloatLanes values[kVectors];
    for (int v = 0; v < kVectors; ++v) {
      const FloatLanes off_e = e[v] - l * beam.e_lane - r * beam.e_row, off_g = g[v] - r * beam.g_row;
      values[v] = Weight<kWeight>::at(rho[v] - l * beam.rho_lane - r * beam.rho_row) *
                  kernel(off_e * off_e + LaneKernel::kShift + off_g * off_g);
      rho[v] += static_cast<float>(kSlices) * beam.rho_slice;
    }
    for (int s = 0; s < kSlices; ++s) {
      float* const to = at + place.voxel() + s * GroupSums::kSlice + Shape::kFirst;
      for (int n = 0; n < Shape::kOfSlice; ++n) {
        const int quad = s * Shape::kOfSlice + n;
        const auto numbers = part<kQuad>(values[quad / kQuads], quad % kQuads);
        float* const row_of_quad = to + Shape::rowOf(n) * GroupSums::kRow;
        if constexpr (Shape::kRowsOfQuad == 2) {
          addToSquare(row_of_quad, GroupSums::kRow, numbers);
        } else {
          addTo(row_of_quad, numbers);
        }
      }
      place.toNextSlice();
    }
    lane += kSlices * beam.step_lane;
    row += kSlices * beam.step_row;
    at += kSlices * GroupSums::kSlice;
  }
}

}  // namespace
}  // namespace bki_mapping
