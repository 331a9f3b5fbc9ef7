/// @file The loops of distance transforms, compiled for each instruction set.
///
/// A voxel's number is the squared distance [voxels^2], within a line, a plane or the whole region, to the
/// nearest obstacle if it is none, and minus that to the nearest voxel that is no obstacle if it is one. So
/// one array serves both transforms: in each, the voxels of the other kind have distance 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace bki_mapping {

/// Columns that are worked on at once: a cache line.
constexpr std::size_t kChunk = 16;
/// Stands for the square of an infinite distance. Adding the square of any distance does not overflow.
constexpr std::int32_t kNone = 1 << 30;

struct DistanceKernels {
  const char* instruction_set;

  /// Squared distances along columns. @param first kChunk columns: positive where there is no obstacle,
  /// negative where there is; overwritten. @param stride from row to row. @param rows at most 16384.
  void (*sweepColumns)(std::int32_t* first, std::size_t stride, std::size_t rows);

  /// Adds the distance along a row. @param row with memory for whole chunks, likewise `result`.
  /// @param scratch rowScratch(width) elements.
  void (*searchRow)(const std::int32_t* row, std::size_t width, std::int32_t* scratch, std::int32_t* result);

  /// Adds the distance along kChunk columns, and takes the signed root. @param first the element of each
  /// column in the first layer. @param stride from layer to layer. @param scratch columnScratch(layers)
  /// elements.
  /// @param result [m], layer by layer.
  void (*searchColumns)(const std::int32_t* first, std::size_t stride, std::size_t layers, float resolution,
                        std::int32_t* scratch, float* result);
};

constexpr std::size_t wholeChunks(std::size_t width) {
  return (width + kChunk - 1) / kChunk * kChunk;
}
constexpr std::size_t rowScratch(std::size_t width) {
  return 6 * (wholeChunks(width) + kChunk);
}
constexpr std::size_t columnScratch(std::size_t layers) {
  return 2 * kChunk * layers;
}

/// @param instruction_set one of instructionSets(); the fastest if empty.
/// @throws std::invalid_argument for any other.
const DistanceKernels& distanceKernelsFor(const std::string& instruction_set);

}  // namespace bki_mapping
