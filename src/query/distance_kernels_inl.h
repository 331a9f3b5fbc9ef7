/// @file Exact Euclidean distance transforms, a vector of voxels at a time, over the vocabulary of
/// simd/vec.h.
///
/// A transform is separable: the minimum over x, y and z of the sums of squares is that over one axis after
/// the other (Felzenszwalb and Huttenlocher, Distance Transforms of Sampled Functions, 2012). Their lower
/// envelope of parabolas takes a constant number of steps a voxel, each of which waits for the one before.
/// Here each voxel instead looks along the line, at both sides, until what is farther cannot be nearer: as
/// many steps as its distance in voxels, of one load, addition and minimum, for a vector of voxels at once.
/// For the distances of streets and rooms that is several times as fast.
#pragma once

#include "query/distance_kernels.h"

namespace bki_mapping {
namespace {

/// A distance that stands for none, whose square is kNone [voxels].
constexpr std::int32_t kFar = 1 << 15;
static_assert(kFar * kFar == kNone);

[[gnu::always_inline]] inline IntVec Abs(IntVec v) {
  return Max(v, -v);
}

/// Counts on from the voxel before: distance to the last voxel of the other kind, with the voxel's sign.
[[gnu::always_inline]] inline IntVec countOn(IntVec count, IntVec kind) {
  return IfThenElse(kind > 0, Max(count, IntVec{}) + 1, Min(count, IntVec{}) - 1);
}

/// The count of the first voxel of a line.
[[gnu::always_inline]] inline IntVec startCount(IntVec kind) {
  return IfThenElse(kind > 0, Set(kFar), Set(-kFar));
}

inline void sweepVector(std::int32_t* first, std::size_t stride, std::size_t rows) {
  IntVec count = startCount(LoadU(first));
  StoreU(count, first);
  for (std::size_t row = 1; row < rows; ++row) {
    std::int32_t* const at = first + row * stride;
    count = countOn(count, LoadU(at));
    StoreU(count, at);
  }
  count = startCount(LoadU(first + (rows - 1) * stride));
  for (std::size_t row = rows; row-- > 0;) {
    std::int32_t* const at = first + row * stride;
    const IntVec before = LoadU(at);
    if (row + 1 < rows) count = countOn(count, before);
    const IntVec nearest = Min(Min(Abs(before), Abs(count)), Set(kFar)), square = nearest * nearest;
    StoreU(IfThenElse(before > 0, square, -square), at);
  }
}

void sweepColumns(std::int32_t* first, std::size_t stride, std::size_t rows) {
  for (std::size_t lane = 0; lane < kChunk; lane += kLanes) sweepVector(first + lane, stride, rows);
}

/// Splits signed squares into those to obstacles and those to the other voxels.
[[gnu::always_inline]] inline void split(IntVec squares, std::int32_t* outside, std::int32_t* inside) {
  StoreU(Max(squares, IntVec{}), outside);
  StoreU(Max(-squares, IntVec{}), inside);
}

/// The least sum along a row that has kNone at either side, as far as the row is long.
[[gnu::always_inline]] inline IntVec leastAlongRow(const std::int32_t* at, std::int32_t width) {
  IntVec least = LoadU(at);
  for (std::int32_t d = 1; d < width && AnyTrue(least > d * d); ++d) {
    least = Min(least, Min(LoadU(at - d), LoadU(at + d)) + d * d);
  }
  return least;
}

void searchRow(const std::int32_t* row, std::size_t width, std::int32_t* scratch, std::int32_t* result) {
  const std::size_t whole = wholeChunks(width), margin = whole + kChunk, length = 3 * margin;
  std::int32_t *const outside = scratch + margin, *const inside = outside + length;
  for (std::int32_t* half = scratch; half <= scratch + length; half += length) {
    for (std::size_t n = 0; n < length; n += kLanes) StoreU(Set(kNone), half + n);
  }
  IntVec least_outside = Set(kNone), least_inside = Set(kNone);
  for (std::size_t x = 0; x < whole; x += kLanes) split(LoadU(row + x), outside + x, inside + x);
  for (std::size_t x = width; x < whole; ++x) outside[x] = inside[x] = kNone;
  for (std::size_t x = 0; x < whole; x += kLanes) {
    least_outside = Min(least_outside, LoadU(outside + x));
    least_inside = Min(least_inside, LoadU(inside + x));
  }
  const bool any_obstacle = AnyTrue(least_outside < kNone), any_other = AnyTrue(least_inside < kNone);
  const auto count = static_cast<std::int32_t>(width);
  for (std::size_t x = 0; x < whole; x += kLanes) {
    const IntVec to_obstacle = any_obstacle ? leastAlongRow(outside + x, count) : LoadU(outside + x),
                 to_other = any_other ? leastAlongRow(inside + x, count) : LoadU(inside + x);
    StoreU(IfThenElse(LoadU(row + x) > 0, to_obstacle, -to_other), result + x);
  }
}

[[gnu::always_inline]] inline IntVec vectorAt(const std::int32_t* column, std::int32_t n) {
  return LoadU(column + static_cast<std::ptrdiff_t>(n) * kLanes);
}

/// The least sum along a column of vectors. @param position of `column` that it is for.
[[gnu::always_inline]] inline IntVec leastAlongColumn(const std::int32_t* column, std::int32_t position,
                                                      std::int32_t layers) {
  IntVec least = vectorAt(column, position);
  for (std::int32_t d = 1; AnyTrue(least > d * d); ++d) {
    const bool below = d <= position, above = position + d < layers;
    if (!below && !above) break;
    if (below) least = Min(least, vectorAt(column, position - d) + d * d);
    if (above) least = Min(least, vectorAt(column, position + d) + d * d);
  }
  return least;
}

[[gnu::always_inline]] inline FloatVec rootOf(IntVec square, float resolution) {
  const FloatVec root = resolution * Sqrt(ConvertTo<FloatVec>(square));
  return IfThenElse(square >= kNone, Set(__builtin_inff()), root);
}

void searchColumns(const std::int32_t* first, std::size_t stride, std::size_t layers, float resolution,
                   std::int32_t* scratch, float* result) {
  std::int32_t *const outside = scratch, *const inside = scratch + kChunk * layers;
  const auto count = static_cast<std::int32_t>(layers);
  for (std::size_t lane = 0; lane < kChunk; lane += kLanes) {
    for (std::size_t z = 0; z < layers; ++z) {
      split(LoadU(first + z * stride + lane), outside + z * kLanes, inside + z * kLanes);
    }
    for (std::int32_t z = 0; z < count; ++z) {
      const IntVec own = LoadU(first + static_cast<std::size_t>(z) * stride + lane);
      const FloatVec to_obstacle = rootOf(leastAlongColumn(outside, z, count), resolution),
                     to_other = rootOf(leastAlongColumn(inside, z, count), resolution);
      StoreU(IfThenElse(own > 0, to_obstacle, resolution - to_other),
             result + static_cast<std::size_t>(z) * kChunk + lane);
    }
  }
}

constexpr DistanceKernels kDistanceKernels = {kInstructionSet, sweepColumns, searchRow, searchColumns};

}  // namespace
}  // namespace bki_mapping
