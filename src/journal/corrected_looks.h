/// @file The looks of a map where its scans move.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "bki_mapping/mapping/mapper_config.h"
#include "journal/moved_looks.h"
#include "journal/scan_journal.h"
#include "journal/scan_mover.h"

namespace bki_mapping {

/// Makes the looks of those regions anew in which scans have moved: what these saw at their old poses cannot
/// be subtracted, and stays in the map until then. The new looks of a region come from the moves, as far as
/// its scans have moved (MovedLooks); other scans are looked through again, in batches, by the owner's
/// thread. Few regions are under way at once, those nearest to the robot first.
///
/// Regions with evidence that is of no scan of the journal keep their old looks. Not thread-safe;
/// noteMoved(), next() and putInto() must not be called while the thread has a batch.
class CorrectedLooks {
 public:
  using Number = ScanJournal::Number;

  /// @param config of the map. @param journal its scans; must outlive this. @param memory limit of MovedLooks
  /// [bytes].
  CorrectedLooks(const MapperConfig& config, const ScanJournal& journal, std::size_t memory);

  /// Notes a scan that has come into the map, and into the journal.
  void noteAdded(Number scan);
  /// Notes that scans have moved in the map; the journal still has the regions that they touched before.
  /// @param moved its looks are taken.
  void noteMoved(const std::vector<Number>& scans, ScanMover::Moved& moved);
  /// Notes that a box of the map was cleared.
  void noteCleared();
  /// More scans are to be moved: what has been made is out of date, and scans come first.
  void noteCorrected();
  /// Forgets all: the map was emptied.
  void reset();

  /// Whether the looks of all regions are made and in the map; of those within a distance of the robot [m].
  bool areDone() const { return changed_regions_.empty() && !looks_; }
  bool areDone(const Eigen::Vector3d& robot, double within) const;
  /// Whether next() would make looks within a distance of the robot [m], though scans are left to be moved.
  bool areDue(const Eigen::Vector3d& robot, double within) const {
    return (looks_ || moves_before_looks_ == 0) && !areDone(robot, within);
  }

  /// Scans to be looked through, with ScanMover::addLooks(scan, *to).
  struct Batch {
    std::vector<PlacedJournalScan> scans;
    std::shared_ptr<LooksByRegion> to;
    std::size_t done = 0;  ///< scans
  };
  /// What is to be looked through next, if anything is. @param within only for regions within this distance
  /// of the robot [m]. @param all_moved whether no scan is left to be moved; otherwise, as many scans have to
  /// move before the next looks as were looked through for the last ones. @param mover with which one of the
  /// last scans is looked through here, where more keep coming; nullptr: none is.
  std::optional<Batch> next(const Eigen::Vector3d& robot, double within, bool all_moved, ScanMover* mover);

  /// Whether looks are made, and only have to be put into the map.
  bool areMade() const { return looks_ && to_look_.empty(); }
  /// Replaces the looks of a region in the map. @return the blocks that have changed.
  using Replace = std::function<std::vector<GridIndex>(const GridIndex& region, const LooksByBlock& looks)>;
  /// Puts looks that are made into the map, for a moment; more may be left. @return the blocks that have
  /// changed.
  std::vector<GridIndex> putInto(const Replace& map);

  /// What has been made is out of date: it is made again.
  void restart();
  /// Gives up what is being made: the old looks stay. @return its regions.
  std::vector<GridIndex> giveUp();

 private:
  /// @return whether there are regions whose looks are to be made.
  bool begin(const Eigen::Vector3d& robot, double within);
  /// Looks through one of the last scans.
  void lookAtNext(ScanMover& mover);
  void restart(const std::vector<GridIndex>& regions);
  double distanceTo(const GridIndex& region, const Eigen::Vector3d& robot) const;

  const ScanJournal& journal_;
  double edge_;                          ///< of a region [m]
  bool has_looks_;                       ///< the map
  std::set<GridIndex> changed_regions_;  ///< whose looks must be made anew, without those of looks_
  /// The looks of changed regions as far as they have been made; nullptr: none are being made. The thread
  /// changes the looks, this object the set of regions, while the thread is idle.
  std::shared_ptr<LooksByRegion> looks_;
  std::deque<Number> to_look_;  ///< scans for looks_
  MovedLooks moved_looks_;      ///< of regions in changed_regions_
  /// Scans that are to be moved before looks around the robot are made again: else, on a robot that drives
  /// on, those would take all the time.
  std::size_t moves_before_looks_ = 0;
  int rounds_ = 0;  ///< of batches for the last few scans of looks_
};

}  // namespace bki_mapping
