/// @file Filtering and down-sampling: from a raw scan to hits and beams.
#pragma once

#include <algorithm>
#include <array>

#include "beams/beams.h"
#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/scan_stats.h"
#include "mapping/soft_merge.h"
#include "points/downsample.h"
#include "points/isolated_points.h"

namespace bki_mapping {

/// Points closer than this are not hits: some drivers report missing returns at the sensor [m].
constexpr float kSensorRadius = 1e-3f;

/// A scan after filtering and down-sampling.
struct PreprocessedScan {
  LabelledPoints hits;  ///< empty where neither beams nor soft labels need their order
  std::size_t hit_count = 0;
  Beams beams;  ///< one to each hit, then those cut at max_range
  PointCounts counts;
  double half_range = 0.0;  ///< ScanStats::half_range
};

/// Number of points by their range, in steps of a metre; the last one is all that are farther away.
using RangeHistogram = std::array<std::uint32_t, 300>;

/// Filters and down-samples scans. Keeps its memory from scan to scan.
class ScanPreprocessor {
 public:
  explicit ScanPreprocessor(const MapperConfig& config)
      : config_(config),
        cells_(config.downsample_resolution > 0.0 ? std::min(config.downsample_resolution, config.resolution)
                                                  : config.resolution),
        hits_(config.downsample_resolution, GridGeometry(config.resolution).blockSize()),
        cut_(config.downsample_resolution, GridGeometry(config.resolution).blockSize()) {}

  /// Filters and down-samples a scan. @param beams whether to make beams, too. @return the result, valid
  /// until the next call.
  /// @throws std::invalid_argument if the scan has not one label for each point.
  const PreprocessedScan& process(const ScanView& scan, const ClassTable& classes, ThreadPool& pool,
                                  bool beams = true);

  /// The hits of the last scan; where some have several classes, each once for each of them.
  const PointGroups& hitGroups() const { return hit_groups_; }

 private:
  /// The outputs of one chunk of points.
  struct Sorted {
    Downsampler::Input& hits;
    Downsampler::Input& cut;
    std::vector<UsedPoint>& used;
    PointCounts& counts;
    RangeHistogram& ranges;
  };
  /// Sorts the points `first` to `last` - 1 into hits, cut beams and counts.
  void sortPoints(const ScanView& scan, const ClassTable& classes, std::size_t first, std::size_t last,
                  const Sorted& into) const;

  /// Adds a beam that is cut at the sensor's range, unless its end has no valid index.
  void addCut(const Eigen::Vector3d& origin, const Eigen::Vector3f& end, Downsampler::Input& cut) const;

  /// Adds the scan's beams without a return to the cut beams.
  void addNoReturns(const ScanView& scan, Downsampler::Input& cut);
  /// Appends one beam for each end that is not at the sensor.
  void appendBeams(const std::vector<Eigen::Vector3f>& ends, ThreadPool& pool);

  MapperConfig config_;
  GridGeometry cells_;                        ///< the finer of the voxels and the down-sampling cells
  std::vector<std::vector<UsedPoint>> used_;  ///< of each chunk, for soft labels
  std::vector<PointCounts> counts_;           ///< of each chunk
  IsolatedPoints isolation_;
  const std::vector<std::uint8_t>* isolated_ = nullptr;  ///< of the present scan, if they are sought
  std::vector<RangeHistogram> ranges_;                   ///< of each chunk
  Downsampler hits_, cut_;
  std::vector<MergedPoints> soft_;  ///< the hits by class, if some have several
  PointGroups hit_groups_;
  LabelledPoints cut_points_;
  PreprocessedScan processed_;
};

}  // namespace bki_mapping
