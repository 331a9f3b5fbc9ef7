/// @file Moves scans in a map when their poses are corrected, beside mapping.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "journal/corrected_looks.h"
#include "journal/scan_journal.h"
#include "journal/scan_mover.h"
#include "parallel/gate.h"

namespace bki_mapping {

/// The map that is corrected, in memory or elsewhere. add and replace_looks return the blocks that changed.
struct CorrectedMap {
  std::function<std::vector<GridIndex>(SemanticMap difference)> add;
  std::function<std::vector<GridIndex>(const GridIndex& region, const LooksByBlock& looks)> replace_looks;
  /// Whether scans may be moved now; empty: always.
  std::function<bool()> ready = {};
  /// Reads a scan of which noteStored() was told; called by the thread that moves scans, too.
  ScanMover::Fetch fetch = {};
  /// Is told that update() has something to do; called by the thread that moves scans, too.
  std::function<void()> wake = {};
};

/// Keeps the scans of a map, and moves them to where they belong. A thread of its own computes, for a few
/// scans at a time, the difference that the move makes; update() adds it to the map in one step, so that a
/// snapshot has each scan exactly once, at its old or its new pose. The map then equals, to the bit, the one
/// of all scans at their corrected poses.
///
/// Looks (rules/latest) cannot be subtracted. While scans move, a block keeps the looks at the old poses
/// beside those at the new ones; when no scan near the robot is left to be moved, the looks of the changed
/// regions there are made anew, and when none is left at all, those of the others (CorrectedLooks). Where the
/// map has evidence that is of no scan of the journal, from another map or a forgotten scan, the old looks
/// stay; and where a box was cleared, intervals of looks may differ from those of a map made afresh.
///
/// Not thread-safe; for the thread of the mapper.
class MapCorrector {
 public:
  struct Settings {
    double quantum = 0.0;     ///< to which points are rounded in the sensor's frame [m]; 0: usualQuantum()
    double tolerance = -1.0;  ///< scans that no point of which is farther off stay [m]; < 0: resolution / 10
    std::size_t memory = 0;   ///< of the packed scans in memory [bytes]; 0: no limit
    std::size_t looks_memory = MovedLooks::kMostBytes;  ///< limit of MovedLooks [bytes]
  };

  /// 1 cm; with a resolution below 0.3 m, a hundredth of it, since rounding costs accuracy by their ratio
  /// [m].
  static double usualQuantum(double resolution) { return resolution < 0.3 ? 0.01 * resolution : 0.01; }

  /// @throws as checkCorrectable().
  MapCorrector(const MapperConfig& config, std::shared_ptr<const ClassTable> classes,
               const Settings& settings, CorrectedMap map);
  ~MapCorrector();

  /// Rounds a scan; the result is what must be integrated, and then given to addScan().
  /// @param T_map_sensor pose at which it is integrated.
  RoundedScan round(const ScanView& scan, const Eigen::Isometry3d& T_map_sensor) const;
  /// The same of a scan in the axes of the sensor, as it was recorded: turned to the axes of the map and
  /// back, some points would be rounded to others.
  RoundedScan roundRecorded(const ScanView& scan, const Eigen::Isometry3d& T_map_sensor) const;
  /// Notes a scan that has been integrated. @param touched blocks (SemanticMapper::touchedBlocks).
  /// @param T_odometry_sensor its recorded pose in a frame that does not jump.
  void addScan(SensorScan scan, std::size_t sensor, const Eigen::Isometry3d& T_map_sensor,
               const Eigen::Isometry3d& T_odometry_sensor, const std::vector<GridIndex>& touched);
  /// Notes a scan that is in the map from before, as addScan() has made it: packed, with its settings and the
  /// number of boxes that had been cleared before it.
  void restore(JournalScan scan);
  /// The settings with which later scans are integrated. @throws as checkCorrectable(); nothing has then
  /// changed.
  void reconfigure(const MapperConfig& config);
  /// @throws std::invalid_argument in one sentence if the map depends on the order of scans with these
  /// settings.
  static void checkCorrectable(const MapperConfig& config);
  /// Notes what happens to the map beside scans, as ScanJournal does; what is under way is given up.
  void noteCleared(const Eigen::AlignedBox3d& box);
  void noteForeign(const std::vector<GridIndex>& regions);
  /// Notes that the recorded poses jump (ScanJournal::noteJump).
  void noteJump(std::uint64_t stamp) { journal_.noteJump(stamp); }
  /// The map was emptied: forgets all scans; the counts of Progress stay.
  void reset();
  /// Forgets all scans, which stay where they are in the map.
  void forget();

  /// Sets where the scans belong (ScanJournal::setPath). What has been moved already stays moved.
  /// @return whether any keyframe lies among the scans; otherwise nothing has changed.
  bool correct(const std::vector<StampedMotion>& keyframes,
               const std::vector<Eigen::Isometry3d>& T_sensor_keyframe);

  /// Sets where each scan of the journal belongs, in order. @throws std::invalid_argument unless there are as
  /// many poses.
  void correctTo(const std::vector<Eigen::Isometry3d>& T_map_sensor);

  /// Adds to the map what is ready, and has the next scans moved: those near a place first, and of these the
  /// newest. Call it between scans. @param robot position in the map frame [m].
  /// @param may_change whether the map may be changed, which takes some ten milliseconds; otherwise, what is
  /// ready waits. @return the changed blocks.
  std::vector<GridIndex> update(const Eigen::Vector3d& robot, bool may_change = true);
  /// Calls update() until nothing is left to be done, and works in the calling thread, with its priority.
  /// Takes as long as that takes.
  void finish(const Eigen::Vector3d& robot);

  /// Is to be closed while a scan is mapped; nullptr where the mapper leaves a core to the thread.
  Gate* gate() { return gate_if_needed_; }

  const ScanJournal& journal() const { return journal_; }
  /// The poses where the kept scans belong, by rising stamp.
  std::vector<StampedMotion> trajectory() const;

  /// The scans that were added, and moved, since the last call, by number; for a map file.
  struct Changes {
    std::vector<ScanJournal::Number> added;
    std::set<ScanJournal::Number> moved;
  };
  Changes takeChanges() { return std::exchange(changes_, {}); }
  /// Number of scans that were added since takeChanges().
  std::size_t unsavedScans() const { return changes_.added.size(); }
  /// Notes that a scan is on its way to a map file, from which it can be fetched.
  void noteStored(ScanJournal::Number number) { journal_.setStored(number); }

  struct Progress {
    std::uint64_t scans = 0;      ///< in the journal
    std::uint64_t bytes = 0;      ///< that they take in memory
    std::uint64_t forgotten = 0;  ///< to keep within the limit; they stay where they are
    std::uint64_t paths = 0;      ///< calls of correct()
    std::uint64_t moved = 0;      ///< moves of scans
    std::uint64_t to_go = 0;      ///< scans that are still to be moved
    std::uint64_t failed = 0;     ///< scans that cannot be moved to where they belong
    double largest_move = 0.0;    ///< of a point of a scan, by the last path [m]
    double scan_ms = 0.0;         ///< time of the thread for a scan, in the last moves [ms]
    bool done = true;             ///< whether the map is that of the corrected poses
    bool done_around = true;      ///< whether it is so within kAround of the robot
    std::string fault;            ///< why the last failed scan cannot be moved
  };
  Progress progress() const;

  /// Scans move first where they may touch what is within this distance of the robot, and the looks there are
  /// then made before other scans move [m].
  static constexpr double kAround = 40.0;

 private:
  using Number = ScanJournal::Number;
  // What the thread does, and what comes of it:
  struct Packing {
    std::vector<std::pair<Number, std::shared_ptr<const SensorScan>>> scans;
    std::vector<std::shared_ptr<const std::string>> packed;
  };
  struct Moving {
    std::vector<Number> numbers;
    std::vector<ScanMove> moves;
    std::optional<ScanMover::Moved> moved;
    double ms = 0.0;
  };
  using Looking = CorrectedLooks::Batch;
  struct Job {
    std::variant<Packing, Moving, Looking> work;
    std::uint64_t generation = 0;
    std::string fault = {};   ///< why it has failed; "" if it has not
    bool unreadable = false;  ///< the fault is of a scan, not of the moment
    bool begun = false, done = false;
  };

  void work();
  void perform(Job& job);
  /// Has the thread do a job, after those before it.
  void start(Job job);
  /// The oldest job, if it is done. @param may_move also if it has moved scans.
  std::optional<Job> takeDone(bool may_move);

  std::vector<GridIndex> take(Job& job);
  void takePacked(const Job& job, const Packing& packing);
  void takeLooks(const Job& job, const Looking& looking);
  /// A scan cannot be placed anywhere else.
  void leaveWhereItIs(Number number, const std::string& fault);
  /// Packs a scan in this thread, where too many wait for the other one.
  void packNext();
  std::vector<GridIndex> takeMoved(Job& job, Moving& moving);
  /// The scans of a job could not be moved: tries each of them alone, or gives up the only one.
  void giveUp(const Moving& moving, const std::string& fault);
  /// Starts the job that comes next, if any may be started. @param may_look whether this thread may look
  /// through a scan. @return whether it has.
  bool startNext(const Eigen::Vector3d& robot, bool may_look);
  bool startPacking();
  struct NextMove {
    std::optional<Number> number;
    bool is_around = false;    ///< it is, or will be, where the robot may see what it saw
    bool around_left = false;  ///< there is such a scan, perhaps one under way
  };
  NextMove nextMove(const Eigen::Vector3d& robot) const;
  void startMoving(Number newest);
  /// @param within only of regions within this distance of the robot [m].
  bool startLooking(const Eigen::Vector3d& robot, double within, bool may_look);
  /// Gives up the looks that are being made: the old ones stay.
  void giveUpLooks(const std::string& fault);
  /// Marks all scans after new poses were set.
  void markAll();
  /// Marks a scan as to be moved, or not, by where it is.
  void mark(JournalScan& scan) const;
  void countToGo();

  Settings settings_;
  CorrectedMap map_;
  std::shared_ptr<const MapperConfig> config_;
  ScanJournal journal_;
  Changes changes_;
  std::deque<Number> unpacked_;
  CorrectedLooks looks_;
  bool alone_ = false;  ///< moves one scan at a time, because several have failed
  Progress progress_;
  std::uint64_t generation_ = 0;  ///< of what results of jobs may be added to the map
  std::set<Number> under_way_;    ///< scans in jobs that move them
  bool looking_ = false;          ///< a job looks through scans; none then moves any
  bool alone_at_work_ = false;    ///< jobs are done by the mapper's thread, in finish()

  Gate* gate_if_needed_ = nullptr;

  // Shared with the thread:
  Gate gate_;
  std::unique_ptr<ScanMover> mover_;  ///< the thread's, while a job moves or looks through scans
  std::mutex mutex_;
  std::condition_variable wake_, ended_;
  std::list<Job> jobs_;  ///< in the order in which they are done, and then taken
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace bki_mapping
