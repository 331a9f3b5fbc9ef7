/// @file Measures how long a map keeps what was never there: snow, rain, fog, images in panes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/core/scan.h"
#include "evaluation/occupants.h"

namespace bki_mapping {

/// Points of what is not there, and those of them whose voxels are occupied.
struct Traces {
  std::size_t points = 0, left = 0;
  double fraction() const {
    return static_cast<double>(left) / static_cast<double>(points);
  }  ///< NaN of none
};

/// What such points leave. Those in voxels with another point, of any scan, do not count.
struct TraceQuality {
  /// Upper limits of the distances from the sensor [m]; each includes those before.
  static constexpr std::array<double, 4> kDistances{5.0, 10.0, 20.0, 50.0};
  static constexpr std::array<double, 2> kAges{1.0, 10.0};  ///< [s]

  struct UpTo {
    std::array<Traces, 2> after;  ///< kAges after each point
    Traces at_end;                ///< of the points that are kAges[0] old or older then
  };
  std::array<UpTo, 4> up_to;
  std::size_t points = 0;      ///< of what is not there, in all scans
  std::size_t all_points = 0;  ///< of all kinds
};

/// Follows a drive scan by scan, with the map after each.
class TraceEvaluation {
 public:
  /// A property of a point, by its label.
  using Has = bool (*)(std::uint32_t label);

  /// @param is_trace whether a point counts. @param is_nothing whether nothing is there; all that count are.
  TraceEvaluation(const GridGeometry& geometry, Has is_trace, Has is_nothing)
      : geometry_(geometry), is_trace_(is_trace), is_nothing_(is_nothing) {}

  /// Adds the next scan, after it is in the map. @param map what the map shows right after the scan.
  void add(const Scan& scan, Occupants& map);
  /// @param map what the map shows at the end.
  TraceQuality quality(Occupants& map) const;

 private:
  struct Point {
    std::uint32_t voxel;
    double time;      ///< [s]
    double distance;  ///< [m]
    std::array<bool, 2> left = {};
  };
  struct Voxel {
    VoxelIndex index;
    bool is_shared = false;  ///< with a point of something
  };

  std::uint32_t voxelAt(const Eigen::Vector3d& point);

  GridGeometry geometry_;
  Has is_trace_, is_nothing_;
  GridTable index_of_;
  std::vector<Voxel> voxels_;
  std::vector<Point> points_;                 ///< by rising time
  std::array<std::size_t, 2> followed_ = {};  ///< number of points that are as old as kAges
  double last_time_ = 0.0;                    ///< of the last scan [s]
  std::size_t all_points_ = 0;
};

/// Removes the points of nothing from a scan. @param[in,out] predicted other labels of the same points.
void removeNothing(TraceEvaluation::Has is_nothing, Scan& scan, std::vector<std::uint32_t>& predicted);

}  // namespace bki_mapping
