/// @file Measures how soon a map shows what comes, and how soon it clears what goes.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/grid_table.h"
#include "bki_mapping/core/scan.h"
#include "evaluation/occupants.h"
#include "evaluation/passing_beams.h"
#include "simulation/truth_cloud.h"

namespace bki_mapping {

/// Points of a scan, and those of them in occupied voxels of the map right after that scan.
struct PresentPoints {
  std::size_t points = 0, present = 0;
  std::size_t named = 0;  ///< of those present, those whose voxel has a class that the scan hit in it

  double accuracy() const { return static_cast<double>(present) / static_cast<double>(points); }  ///< PA
  double namedShare() const { return static_cast<double>(named) / static_cast<double>(present); }
};

/// Times until something happened in a voxel [s]; never counts as infinite.
struct Delays {
  std::vector<double> seconds;  ///< of those that happened
  std::size_t never = 0;

  std::size_t count() const { return seconds.size() + never; }
  /// NaN of none, infinite if it never happened. @param share 0 to 1.
  double quantile(double share) const;
};

/// How present the map is. PA (present accuracy) is the share of a scan's own points in occupied voxels of
/// the map right after it.
struct PresenceQuality {
  static constexpr std::array<double, 2> kDistances = {20.0, 50.0};  ///< ends of the bins of distance [m]

  /// Points of classes that can move, up to each distance of kDistances from the sensor.
  std::array<PresentPoints, 2> moving, standing;
  /// Voxels into which something moved that has not left them since it was last hit, hidden or not, and those
  /// of them that are occupied in the map at the end. Only where the truth is known.
  std::size_t stayed = 0, stayed_present = 0;
  double stayedShare() const { return static_cast<double>(stayed_present) / static_cast<double>(stayed); }
  Delays appear;  ///< from the first hit of something moving in a voxel until the voxel is occupied
  Delays clear;  ///< from the first beam near a voxel that something moving has left until it is not occupied
};

/// Follows a drive scan by scan, with the map after each.
class PresenceEvaluation {
 public:
  /// Whether a voxel contains an object that can move at a time [s, as the stamps of scans].
  using Taken = std::function<bool(const VoxelIndex& voxel, double time)>;

  PresenceEvaluation(const GridGeometry& geometry, KittiLabels moving)
      : geometry_(geometry), moving_(std::move(moving)) {}
  /// Call before add() if the truth is known.
  void setTruth(Taken taken) { taken_ = std::move(taken); }

  /// Adds the next scan, after it is in the map. The first scans only show what is there: kFirstScans.
  /// @param scan with true labels. @param map what the map shows right after the scan.
  void add(const Scan& scan, const ClassTable& classes, Occupants& map);
  /// @param map what the map shows at the end.
  PresenceQuality quality(Occupants& map) const;

  /// Scans before the first that counts.
  static constexpr std::size_t kFirstScans = 2;
  /// What was not hit for this long is hit anew [s].
  static constexpr double kAnew = 1.0;

 private:
  enum class Wait : std::uint8_t { kNone, kToAppear, kToBeSeen, kToClear };
  struct Voxel {
    VoxelIndex index;
    double last_hit = 0.0, since = 0.0;  ///< of the last point, and of the wait [s]
    bool is_shared = false;              ///< with static points
    bool waits = false;                  ///< is in waiting_
    bool came = false;                   ///< something moved into it while the drive went on
    Wait wait = Wait::kNone;
  };
  struct Delay {
    std::uint32_t voxel;
    bool appears;
    double seconds;  ///< infinite: never
  };

  std::uint32_t voxelAt(const VoxelIndex& index);
  void start(std::uint32_t n, Wait wait, double time);
  void follow(const Scan& scan, double time, Occupants& map);
  bool isTaken(const Voxel& voxel, double time) const { return taken_ && taken_(voxel.index, time); }
  /// Whether a voxel has been taken since it was last hit, by samples of half a second.
  bool stays(const Voxel& voxel) const;

  GridGeometry geometry_;
  KittiLabels moving_;
  Taken taken_;  ///< empty: the truth is not known
  std::size_t scans_ = 0;
  double last_time_ = 0.0;  ///< of the last scan [s]
  GridTable index_of_;
  std::vector<Voxel> voxels_;
  std::vector<std::uint32_t> waiting_;
  std::vector<Delay> delays_;
  PresenceQuality quality_;  ///< all but the delays
  PassingBeams beams_;
};

}  // namespace bki_mapping
