/// @file One point a cell.
#pragma once

#include <array>
#include <vector>

#include "bki_mapping/core/grid_geometry.h"
#include "bki_mapping/inference/parallel_for.h"

namespace bki_mapping {

/// Points with a class each, relative to the sensor.
struct LabelledPoints {
  std::vector<Eigen::Vector3f> points;  ///< relative to the sensor, axes of the map frame [m]
  std::vector<ClassId> labels;          ///< as long as `points`
};

/// Merges the points of each cubic cell of the map frame into their centroid, labelled by the majority
/// (ties: the smaller id). Cells come in the order in which they are first hit. Points are added in chunks,
/// which several threads may fill side by side; the points' order is chunk by chunk. Keeps its memory from
/// scan to scan.
class Downsampler {
 public:
  /// Forgets all points.
  /// @param origin of the points in the map frame [m]. @param cell edge [m]; 0 merges nothing.
  void start(const Eigen::Vector3d& origin, double cell, std::size_t chunks);

  /// Adds a point relative to the origin. Two threads must not add to the same chunk at once.
  void add(std::size_t chunk, const Eigen::Vector3f& point, ClassId label);

  /// Merges the points. @param[out] output one point a cell, in the order promised.
  void finish(Workers& workers, LabelledPoints& output);
  /// Merges the points; the result stays here, partition by partition, in an order that does not depend on
  /// the number of workers. Cheaper than finish.
  void finish(Workers& workers);

  /// A point of the result.
  struct Merged {
    Eigen::Vector3f point;
    ClassId label;
  };
  static constexpr std::size_t partitions() { return kPartitions; }
  const std::vector<Merged>& merged(std::size_t partition) const { return merged_[partition]; }

 private:
  /// Cells are spread over this many partitions by a hash, so that each can be merged by one thread, in a
  /// table that fits its cache.
  static constexpr std::size_t kPartitions = 64;

  struct Record {
    Eigen::Vector3f point;
    GridIndex cell;
    std::uint32_t place;  ///< in the chunk
    ClassId label;
  };
  struct Chunk {
    std::array<std::vector<Record>, kPartitions> records;
    std::vector<std::uint32_t> cell_of;  ///< partition and cell of each point that is its cell's first
    std::size_t begin = 0;               ///< of these cells in the output
  };
  struct Cell {
    GridIndex index;
    Eigen::Vector3d sum;
    std::uint32_t count;
    std::uint32_t votes;  ///< for `label`
    std::uint32_t more;   ///< first of the votes for other labels
    ClassId label;
  };
  struct Votes {
    ClassId label;
    std::uint32_t count, next;
  };
  /// Working memory of one thread, for one partition at a time.
  struct Scratch {
    std::vector<std::uint32_t> slots;  ///< of a hash table: number of a cell, or kNone
    std::vector<Cell> cells;
    std::vector<Votes> votes;
  };

  void merge(std::size_t partition, Scratch& scratch);
  /// @return the cell's number if the record is its first.
  static std::uint32_t mergeRecord(const Record& record, Scratch& scratch);
  void write(const Chunk& chunk, LabelledPoints& output) const;
  static void vote(Cell& cell, ClassId label, std::vector<Votes>& votes);
  static ClassId majority(const Cell& cell, const std::vector<Votes>& votes);

  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
  double cell_ = 0.0;
  GridGeometry grid_{1.0};
  std::size_t used_ = 0;  ///< chunks of this scan
  std::vector<Chunk> chunks_;
  std::vector<Scratch> scratch_;
  std::array<std::vector<Merged>, kPartitions> merged_;
};

}  // namespace bki_mapping
