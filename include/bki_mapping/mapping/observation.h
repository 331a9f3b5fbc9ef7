/// @file From a raw scan to hits and beams.
#pragma once

#include <algorithm>
#include <cstddef>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/config.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/inference/beams.h"
#include "bki_mapping/inference/downsample.h"
#include "bki_mapping/mapping/soft_merge.h"

namespace bki_mapping {

/// What became of a scan's points; `points` is the sum of those that follow.
struct PointCounts {
  std::size_t points = 0;
  std::size_t used = 0;           ///< became hits
  std::size_t not_finite = 0;     ///< NaN or infinite: a coordinate, or a share of a class
  std::size_t at_sensor = 0;      ///< within 1 mm of the sensor
  std::size_t too_near = 0;       ///< nearer than sensor_model/min_range
  std::size_t beyond_max = 0;     ///< farther than SensorModelConfig::reach()
  std::size_t outside_map = 0;    ///< too far from the map's origin for an index
  std::size_t unknown_label = 0;  ///< not in the class table, and unknown_labels is ignore
  std::size_t unlabelled = 0;     ///< of the unlabelled class, and unlabelled_points is ignore
  std::size_t no_returns = 0;     ///< beams that met nothing, which clear up to the sensor's range
  /// Labels not in the class table, whatever became of them (not part of the sum).
  std::size_t labels_not_in_table = 0;

  PointCounts& operator+=(const PointCounts& other);
};

/// A scan after filtering and down-sampling.
struct Observation {
  LabelledPoints hits;
  SoftLabels soft;  ///< of the hits; empty where each is of one class alone
  Beams beams;      ///< to each hit, then to the points where beams beyond max_range are cut
  PointCounts counts;
};

/// Turns scans into observations. Keeps its memory from scan to scan.
class Observer {
 public:
  explicit Observer(const MapperConfig& config)
      : config_(config),
        cells_(config.downsample_resolution > 0.0 ? std::min(config.downsample_resolution, config.resolution)
                                                  : config.resolution),
        hits_(config.downsample_resolution, GridGeometry(config.resolution).blockSize()),
        cut_(config.downsample_resolution, GridGeometry(config.resolution).blockSize()) {}

  /// @param beams whether they are wanted, and hits in their order; without soft labels and beams `hits` of
  /// what is returned is empty, too.
  /// @return what was seen; stays until the next call.
  /// @throws std::invalid_argument if the scan's labels are not as many as its points.
  const Observation& observe(const Scan& scan, const ClassTable& classes, Workers& workers,
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
  void appendBeams(const std::vector<Eigen::Vector3f>& ends, Workers& workers);

  MapperConfig config_;
  GridGeometry cells_;                        ///< the finer one of those that points are put into
  std::vector<std::vector<UsedPoint>> used_;  ///< of each chunk, for soft labels
  std::vector<PointCounts> counts_;           ///< of each chunk
  Downsampler hits_, cut_;
  LabelledPoints cut_points_;
  Observation seen_;
};

}  // namespace bki_mapping
