/// @file From a raw scan to hits and beams.
#pragma once

#include <algorithm>

#include "beams/beams.h"
#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/scan_stats.h"
#include "mapping/soft_merge.h"
#include "points/downsample.h"

namespace bki_mapping {

/// A scan after filtering and down-sampling.
struct PreprocessedScan {
  LabelledPoints hits;
  SoftLabels soft;  ///< of the hits; empty where each is of one class alone
  Beams beams;      ///< to each hit, then to the points where beams beyond max_range are cut
  PointCounts counts;
};

/// Turns scans into observations. Keeps its memory from scan to scan.
class ScanPreprocessor {
 public:
  explicit ScanPreprocessor(const MapperConfig& config)
      : config_(config),
        cells_(config.downsample_resolution > 0.0 ? std::min(config.downsample_resolution, config.resolution)
                                                  : config.resolution),
        hits_(config.downsample_resolution, GridGeometry(config.resolution).blockSize()),
        cut_(config.downsample_resolution, GridGeometry(config.resolution).blockSize()) {}

  /// @param beams whether they are wanted, and hits in their order; without soft labels and beams `hits` of
  /// what is returned is empty, too.
  /// @return what was seen; stays until the next call.
  /// @throws std::invalid_argument if the scan's labels are not as many as its points.
  const PreprocessedScan& observe(const Scan& scan, const ClassTable& classes, ThreadPool& pool,
                                  bool beams = true);
  /// The hits of the last scan, in groups of neighbours.
  const Downsampler& hits() const { return hits_; }

 private:
  /// Where one thread puts the points of a chunk.
  struct Sorted {
    Downsampler::Input& hits;
    Downsampler::Input& cut;
    std::vector<UsedPoint>& used;
    PointCounts& counts;
  };
  /// Sorts points first to before last into hits, cut beams and counts.
  void sortPoints(const Scan& scan, const ClassTable& classes, std::size_t first, std::size_t last,
                  const Sorted& into) const;

  /// Adds a beam that is cut at the sensor's range, unless it ends where the map has no voxels.
  void addCut(const Eigen::Vector3d& origin, const Eigen::Vector3f& end, Downsampler::Input& cut) const;

  /// Beams that met nothing, into the chunk of cut ones behind those of the points.
  void addNoReturns(const Scan& scan, Downsampler::Input& cut);
  void appendBeams(const std::vector<Eigen::Vector3f>& ends, ThreadPool& pool);

  MapperConfig config_;
  GridGeometry cells_;                        ///< the finer one of those that points are put into
  std::vector<std::vector<UsedPoint>> used_;  ///< of each chunk, for soft labels
  std::vector<PointCounts> counts_;           ///< of each chunk
  Downsampler hits_, cut_;
  LabelledPoints cut_points_;
  PreprocessedScan seen_;
};

}  // namespace bki_mapping
