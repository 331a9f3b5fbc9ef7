/// @file The scans in a map, each with the pose at which it is there.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/mapping/mapper_config.h"
#include "journal/corrected_path.h"
#include "journal/scan_mover.h"
#include "journal/sensor_scan.h"

namespace bki_mapping {

/// A scan that is in the map.
struct JournalScan {
  std::uint64_t stamp = 0;                 ///< [ns]
  std::shared_ptr<const SensorScan> scan;  ///< until it is packed
  /// By packScan(); nullptr until then, and again when only the map file has it.
  std::shared_ptr<const std::string> packed;
  bool stored = false;  ///< a map file has it
  std::shared_ptr<const MapperConfig> settings;
  std::size_t sensor = 0;  ///< number of the sensor, for the pose of the robot's frame in its frame
  /// The recorded pose of the sensor in a frame that does not jump, and the pose at which the scan is in the
  /// map.
  Eigen::Isometry3d T_odometry_sensor, T_map_sensor;
  Eigen::Isometry3d wanted;        ///< T_map_sensor of the last path; the pose in the map without one
  double reach = 0.0;              ///< of its farthest hit [m]
  std::vector<GridIndex> regions;  ///< that it touches at T_map_sensor, sorted
  std::size_t cleared_before = 0;  ///< number of boxes that had been cleared when it was integrated
  bool off = false;                ///< it is to be moved

  /// Whether it can be placed elsewhere: it could be packed.
  bool isKept() const { return scan || isPacked(); }
  bool isPacked() const { return packed || stored; }
};

/// The scans of a map in memory, in the order in which they were integrated. Scans have numbers, which they
/// keep. Not thread-safe.
class ScanJournal {
 public:
  /// @param memory limit for the packed scans [bytes]; when they take more, the oldest are only in the map
  /// file, or, without one, forgotten: they then stay where they are in the map. 0: no limit.
  /// @param in_file whether a map file takes the scans; those that it has not taken, because it cannot be
  /// written, are forgotten at twice the limit.
  explicit ScanJournal(std::size_t memory = 0, bool in_file = false) : memory_(memory), in_file_(in_file) {}

  using Number = std::uint64_t;
  /// Adds a scan. @return its number.
  Number add(JournalScan scan);
  /// Stores the packed form of a scan, unless it has been forgotten.
  void setPacked(Number number, std::shared_ptr<const std::string> packed);
  /// A scan cannot be placed anywhere else: it stays where it is.
  void leave(Number number);
  /// Notes that a map file has a scan, from which it can be fetched.
  void setStored(Number number);
  /// Notes that a box of the map was cleared.
  void noteCleared(const Eigen::AlignedBox3d& box) { cleared_.push_back(box); }
  /// Notes that the map has evidence in regions that is not of scans of this journal.
  void noteForeign(const std::vector<GridIndex>& regions) { foreign_.insert(regions.begin(), regions.end()); }
  /// Notes that the recorded poses jump. @param stamp of the first pose after the jump [ns].
  void noteJump(std::uint64_t stamp) { jumps_.insert(stamp); }
  /// Forgets all scans, and all else.
  void clear();

  /// Sets where the scans belong. @param keyframes poses of a frame of the robot in the map frame.
  /// @param T_sensor_keyframe the pose of that frame in the frame of each sensor.
  /// @return whether any keyframe lies among the scans; otherwise nothing has changed.
  bool setPath(const std::vector<StampedMotion>& keyframes,
               const std::vector<Eigen::Isometry3d>& T_sensor_keyframe);

  /// How far a scan is from where it belongs: the farthest move of any of its points, at most [m].
  static double errorOf(const JournalScan& scan);

  Number begin() const { return first_; }
  Number end() const { return first_ + scans_.size(); }
  const JournalScan& at(Number number) const { return scans_[number - first_]; }
  JournalScan& at(Number number) { return scans_[number - first_]; }
  bool has(Number number) const { return number >= begin() && number < end(); }
  std::size_t size() const { return scans_.size(); }
  std::size_t bytes() const { return bytes_; }                      ///< of the packed scans in memory
  std::size_t bytesNotStored() const { return bytes_not_stored_; }  ///< of those that no file has
  std::uint64_t forgotten() const { return forgotten_; }            ///< scans, because of the limit
  /// The stamps of the first poses after jumps [ns].
  const std::set<std::uint64_t>& jumps() const { return jumps_; }
  /// The regions where the map has evidence that is not of scans of this journal.
  const std::set<GridIndex>& foreign() const { return foreign_; }
  /// The scan at its pose in the map, for a ScanMover; it must be packed.
  PlacedJournalScan placed(Number number) const;

 private:
  void keepWithinMemory();
  /// Frees the memory of the packed points of a scan.
  void release(JournalScan& scan);
  void forget(JournalScan& scan);

  std::size_t memory_;
  bool in_file_;
  std::deque<JournalScan> scans_;
  Number first_ = 0;
  Number resident_ = 0;  ///< those before it are not in memory
  std::size_t bytes_ = 0, bytes_not_stored_ = 0;
  std::uint64_t forgotten_ = 0;
  std::vector<Eigen::AlignedBox3d> cleared_;
  std::set<GridIndex> foreign_;
  std::set<std::uint64_t> jumps_;
};

}  // namespace bki_mapping
