/// @file One point a cell.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "parallel/index_numbering.h"
#include "parallel/ordered_queue.h"
#include "parallel/runs_by_index.h"
#include "parallel/thread_pool.h"
#include "points/cell_merger.h"
#include "points/point_kernels.h"
#include "points/tile_grid.h"

namespace bki_mapping {

/// Points with a class each, relative to the sensor.
struct LabelledPoints {
  std::vector<Eigen::Vector3f> points;  ///< relative to the sensor, axes of the map frame [m]
  std::vector<ClassId> labels;          ///< as long as `points`
};

/// Merges the points of each cubic cell of the map frame into their centroid, labelled by the majority
/// (ties: the smaller id). Points are added in chunks, which several threads may fill side by side; the
/// points' order is chunk by chunk. Keeps its memory from scan to scan.
///
/// Each chunk is sorted by tiles, cubes of some thousand cells about as large as a block of the map, while it
/// is in a core's cache; then tiles are merged one by one. A tile needs no hash table, and what it gives lies
/// together in space, which makes sorting it into blocks cheap.
class Downsampler {
 public:
  /// @param cell edge [m]; 0 merges nothing. @param tile edge [m] that tiles shall have, if they can.
  /// @param instruction_set one of instructionSets(); the best there is if empty.
  Downsampler(double cell, double tile, const std::string& instruction_set = "");

  /// Takes the points of one chunk; each thread has its own.
  class alignas(kThreadsApart) Input {
   public:
    void add(const Eigen::Vector3f& point, ClassId label) {
      x_[count_] = point.x();
      y_[count_] = point.y();
      z_[count_] = point.z();
      labels_[count_] = label;
      if (++count_ == kBatch) place();
    }

   private:
    friend class Downsampler;
    struct KnownTile {
      GridIndex index;
      std::uint32_t number;
    };
    void place();
    /// Of a tile that is not the one last met with its short code.
    std::uint32_t findNumber(const GridIndex& tile, KnownTile& known);

    Downsampler* owner_ = nullptr;
    IndexNumbering* tiles_ = nullptr;  ///< of the chunk
    alignas(64) float x_[kBatch], y_[kBatch], z_[kBatch];
    ClassId labels_[kBatch];
    std::size_t count_ = 0;
    TilePlaces places_;
    std::vector<KnownTile> known_;           ///< tiles met last, by a few bits of their index
    std::size_t size_ = 0;                   ///< of the two that follow; they are longer
    std::vector<TilePoint> points_;          ///< of the chunk
    std::vector<std::uint32_t> tile_of_;     ///< number of the tile of each
    std::vector<std::uint32_t> tile_sizes_;  ///< points of each tile
  };

  /// Forgets all points. @param origin of the points in the map frame [m]. @param ordered whether inOrder is
  /// to be called.
  void start(const Eigen::Vector3d& origin, std::size_t chunks, const ThreadPool& pool, bool ordered);
  /// Begins a chunk, to be ended by the same thread before it begins another one.
  Input& open(std::size_t chunk, std::size_t worker);
  void close(std::size_t chunk, std::size_t worker);

  /// Merges the points, once all chunks are closed.
  void finish(ThreadPool& pool);
  std::size_t size() const { return size_; }  ///< points of the result

  /// The result is split into groups, the same for any number of workers. Points of a group are near each
  /// other.
  std::size_t groups() const { return used_groups_; }
  const MergedPoints& merged(std::size_t group) const { return groups_[group].merged; }

  /// The result in the order in which cells were first hit.
  void inOrder(ThreadPool& pool, LabelledPoints& output);

 private:
  struct alignas(kThreadsApart) Chunk {
    IndexNumbering tiles;
    std::vector<std::uint32_t> begin;  ///< of each tile's points; one more than tiles
    std::vector<TilePoint> points;     ///< by tile
    // Where the order counts:
    std::vector<std::uint32_t> place;    ///< of each point in the chunk as it was filled
    std::vector<std::uint32_t> cell_of;  ///< by that place: group and cell of which this is the first point
    std::size_t output = 0;              ///< where its cells begin in the ordered result
  };
  /// Points of one tile in one chunk.
  struct Run {
    std::uint32_t chunk, begin, end;
    std::uint32_t size() const { return end - begin; }
  };
  /// Consecutive tiles.
  struct alignas(kThreadsApart) Group {
    std::uint32_t first_tile, end_tile;
    MergedPoints merged;
  };

  void collectRuns(std::size_t chunk);
  void splitIntoGroups(std::size_t points);
  void prefetch(const Run& run) const;
  void merge(std::uint32_t group, CellMerger& merger);
  void write(const Chunk& chunk, LabelledPoints& output) const;

  const PointKernels* kernels_;
  bool merges_;
  bool ordered_ = false;
  GridGeometry cells_;
  int edge_;  ///< of a tile [cells]
  std::optional<TileGrid> grid_;
  std::size_t used_ = 0, used_groups_ = 0, size_ = 0;
  std::vector<Chunk> chunks_;
  std::vector<Input> inputs_;        ///< one a worker
  std::vector<CellMerger> mergers_;  ///< one a worker
  OrderedQueue turns_;               ///< of chunks, to hand their runs to
  RunsByIndex<Run> tiles_;
  std::vector<Group> groups_;
};

}  // namespace bki_mapping
