#include "journal/scan_journal.h"

#include <algorithm>
#include <utility>

#include "journal/rigid_motion.h"

namespace bki_mapping {

ScanJournal::Number ScanJournal::add(JournalScan scan) {
  scan.cleared_before = cleared_.size();
  scan.wanted = scan.T_map_sensor;
  if (scan.packed) bytes_ += scan.packed->size();
  if (scan.packed && !scan.stored) bytes_not_stored_ += scan.packed->size();
  scans_.push_back(std::move(scan));
  keepWithinMemory();
  return end() - 1;
}

void ScanJournal::setPacked(Number number, std::shared_ptr<const std::string> packed) {
  if (!has(number)) return;
  JournalScan& scan = at(number);
  scan.scan = nullptr;
  if (number < resident_) return;
  bytes_ += packed->size();
  if (!scan.stored) bytes_not_stored_ += packed->size();
  scan.packed = std::move(packed);
  keepWithinMemory();
}

void ScanJournal::leave(Number number) {
  if (!has(number)) return;
  JournalScan& scan = at(number);
  noteForeign(scan.regions);
  release(scan);
  scan.scan = nullptr;
  scan.stored = scan.off = false;
}

void ScanJournal::setStored(Number number) {
  if (!has(number)) return;
  JournalScan& scan = at(number);
  if (!scan.stored && scan.packed) bytes_not_stored_ -= scan.packed->size();
  scan.stored = true;
  keepWithinMemory();
}

void ScanJournal::release(JournalScan& scan) {
  if (!scan.packed) return;
  bytes_ -= scan.packed->size();
  if (!scan.stored) bytes_not_stored_ -= scan.packed->size();
  scan.packed = nullptr;
}

void ScanJournal::forget(JournalScan& scan) {
  noteForeign(scan.regions);
  release(scan);
  scan.off = false;
  ++forgotten_;
}

void ScanJournal::keepWithinMemory() {
  if (memory_ == 0) return;
  for (; bytes_ > memory_ && resident_ + 1 < end(); ++resident_) {
    JournalScan& oldest = at(resident_);
    if (oldest.stored) {
      release(oldest);
    } else if (!oldest.isKept()) {
      continue;  // it has no points
    } else if (!oldest.packed || (in_file_ && bytes_ <= 2 * memory_)) {
      return;
    } else {
      forget(oldest);
    }
    while (!scans_.front().isKept() && first_ <= resident_) {
      scans_.pop_front();
      ++first_;
    }
  }
}

void ScanJournal::clear() {
  first_ = resident_ = end();
  scans_.clear();
  cleared_.clear();
  foreign_.clear();
  jumps_.clear();
  bytes_ = bytes_not_stored_ = 0;
}

bool ScanJournal::setPath(const std::vector<StampedMotion>& keyframes,
                          const std::vector<Eigen::Isometry3d>& T_sensor_keyframe) {
  std::vector<StampedMotion> odometry;
  for (const JournalScan& scan : scans_) {
    odometry.push_back({scan.stamp, scan.T_odometry_sensor * T_sensor_keyframe[scan.sensor]});
  }
  std::stable_sort(odometry.begin(), odometry.end(),
                   [](const StampedMotion& a, const StampedMotion& b) { return a.stamp < b.stamp; });
  const CorrectedPath path(keyframes, odometry, jumps_);
  if (path.empty()) return false;
  for (JournalScan& scan : scans_) {
    scan.wanted = path.poseAt(scan.stamp, scan.T_odometry_sensor).value_or(scan.T_map_sensor);
  }
  return true;
}

double ScanJournal::errorOf(const JournalScan& scan) {
  return farthestMove(scan.wanted * scan.T_map_sensor.inverse(), scan.T_map_sensor.translation(), scan.reach);
}

PlacedJournalScan ScanJournal::placed(Number number) const {
  const JournalScan& scan = at(number);
  const auto after = cleared_.begin() + static_cast<std::ptrdiff_t>(scan.cleared_before);
  return {number, scan.packed, scan.settings, scan.T_map_sensor, {after, cleared_.end()}};
}

}  // namespace bki_mapping
