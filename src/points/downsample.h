/// @file Down-sampling: merges the points of each cell into one.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "parallel/group_by.h"
#include "parallel/index_numbering.h"
#include "parallel/ordered_queue.h"
#include "parallel/thread_pool.h"
#include "points/cell_merger.h"
#include "points/point_kernels.h"
#include "points/tile_grid.h"

namespace bki_mapping {

/// Points and their classes.
struct LabelledPoints {
  std::vector<Eigen::Vector3f> points;  ///< relative to the sensor, axes of the map frame [m]
  std::vector<ClassId> labels;          ///< as long as `points`
};

/// Merges the points of each cubic cell of the map frame into their centroid, labelled by the majority
/// (ties: the smaller id; CellMerger). Points are added in chunks, which several threads may fill at once;
/// the order of the points is that of the chunks. Keeps its memory from scan to scan.
///
/// Each chunk is sorted by tile while it is in a core's cache; then tiles are merged one by one. A tile,
/// about as large as a block, has few enough cells for a plain array instead of a hash table, and its output
/// is close together in space, which makes sorting it into blocks cheap.
class Downsampler {
 public:
  /// @param cell edge [m]; 0 merges nothing. @param tile preferred edge of a tile [m].
  /// @param instruction_set one of instructionSets(); "" selects the best that the processor has.
  Downsampler(double cell, double tile, const std::string& instruction_set = "");

  /// Takes the points of one chunk; each thread has its own.
  class alignas(kThreadsApart) Input {
   public:
    void add(const Eigen::Vector3f& point, ClassId label) {
      x_[count_] = point.x();
      y_[count_] = point.y();
      z_[count_] = point.z();
      labels_[count_] = label;
      if (++count_ == kBatch) flush();
    }

   private:
    friend class Downsampler;
    struct KnownTile {
      GridIndex index;
      std::uint32_t position;  ///< in tiles_, or kNoPosition
    };
    /// Finds the tiles and cells of the batch, and appends its points to the chunk.
    void flush();
    /// Looks up a tile that is not in the cache, and caches it. @return its position in tiles_.
    std::uint32_t findPosition(const GridIndex& tile, KnownTile& known);

    Downsampler* owner_ = nullptr;
    IndexNumbering* tiles_ = nullptr;  ///< of the chunk
    // The batch, in arrays of the layout that the vector loops need:
    alignas(64) float x_[kBatch], y_[kBatch], z_[kBatch];
    ClassId labels_[kBatch];
    std::size_t count_ = 0;
    TilePositions positions_;
    std::vector<KnownTile> known_;           ///< a cache of recent tiles, by shortCode()
    std::size_t size_ = 0;                   ///< points in the next two arrays, which may be longer
    std::vector<TilePoint> points_;          ///< of the chunk
    std::vector<std::uint32_t> tile_of_;     ///< of each point: position of its tile in tiles_
    std::vector<std::uint32_t> tile_sizes_;  ///< number of points in each tile
  };

  /// Forgets all points. @param origin of the points in the map frame [m]. @param ordered whether inOrder()
  /// will be called.
  void start(const Eigen::Vector3d& origin, std::size_t chunks, const ThreadPool& pool, bool ordered);
  /// Starts a chunk. The same thread must close it before it opens another one.
  Input& open(std::size_t chunk, std::size_t worker);
  void close(std::size_t chunk, std::size_t worker);

  /// Merges the points. Call after all chunks are closed.
  void finish(ThreadPool& pool);

  /// The merged points, in groups of points that are close together. The groups do not depend on the number
  /// of workers.
  const PointGroups& merged() const { return merged_; }

  /// Writes the merged points in the order of their cells' first points.
  void inOrder(ThreadPool& pool, LabelledPoints& output);

 private:
  struct alignas(kThreadsApart) Chunk {
    IndexNumbering tiles;
    std::vector<std::uint32_t> begin;  ///< of each tile's points; one element more than tiles
    std::vector<TilePoint> points;     ///< sorted by tile
    // Used only if `ordered`:
    std::vector<std::uint32_t> offset;   ///< of each point in the order of add()
    std::vector<std::uint32_t> cell_of;  ///< by that offset: cell whose first point it is, or kNoPosition
    std::size_t output = 0;              ///< offset of the chunk's first cell in the ordered result
  };
  /// The points of one tile in one chunk.
  struct Run {
    std::uint32_t chunk, begin, end;
    std::uint32_t size() const { return end - begin; }
  };
  /// Consecutive tiles and their merged points.
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
  std::size_t used_ = 0, used_groups_ = 0;
  std::vector<Chunk> chunks_;
  std::vector<Input> inputs_;        ///< one for each worker
  std::vector<CellMerger> mergers_;  ///< one for each worker
  OrderedQueue queue_;               ///< of closed chunks, whose runs are collected in order
  RunsByIndex<Run> tiles_;
  std::vector<Group> groups_;
  PointGroups merged_;
};

}  // namespace bki_mapping
