#include "journal/file_correction.h"

#include <memory>

#include "core/counted.h"
#include "journal/stored_settings.h"

namespace bki_mapping {
namespace {

/// The settings that say whether the map has looks: the last ones with which it got some, if there are any.
const MapperConfig& settingsOfLooks(const std::vector<std::shared_ptr<const MapperConfig>>& settings) {
  for (auto each = settings.rbegin(); each != settings.rend(); ++each) {
    if ((*each)->rules.enabled && (*each)->rules.latest) return **each;
  }
  return *settings.back();
}

MapCorrector::Settings withTolerance(double tolerance) {
  MapCorrector::Settings settings;
  settings.tolerance = tolerance;
  return settings;
}

}  // namespace

FileCorrection::FileCorrection(MapFile& file, double tolerance)
    : stored_(readMap(file)),
      corrector_(settingsOfLooks(journalSettings(file)), journalClasses(file), withTolerance(tolerance),
                 {[this](const SemanticMap& difference) { return add(difference); },
                  [this](const GridIndex& region, const LooksByBlock& looks) {
                    changed_.insert(region);
                    return replaceLooks(stored_.map, region, looks);
                  }}),
      rows_(restoreJournal(file, corrector_)) {}

std::string FileCorrection::move(const std::string& drive, const std::vector<Eigen::Isometry3d>& wanted,
                                 const std::function<void(std::size_t done, std::size_t all)>& progress) {
  std::vector<Eigen::Isometry3d> poses;
  auto next = wanted.begin();
  before_.clear();
  for (std::size_t n = 0; n < rows_.size(); ++n) {
    before_.push_back(corrector_.journal().at(n).T_map_sensor);
    poses.push_back(rows_[n].drive == drive ? *next++ : before_.back());
  }
  progress_ = progress;
  corrector_.correctTo(poses);
  corrector_.finish(Eigen::Vector3d::Zero());
  const MapCorrector::Progress done = corrector_.progress();
  if (done.failed > 0) {
    throw MapFileError(counted(done.failed, "scan") + " of drive '" + drive +
                       "' cannot be moved, and nothing was written: " + done.fault);
  }
  if (progress_ && done.moved > 0) progress_(done.moved, done.moved);
  return done.fault.empty() ? "" : "looks of some regions stay as they were: " + done.fault;
}

void FileCorrection::write(MapFile::Change& change, const std::string& drive, bool all) const {
  if (all) {
    for (const GridIndex& tile : tilesOf(stored_.map)) change.writeTile(stored_.map, {tile});
  } else {
    for (const GridIndex& tile : changed_) change.writeTile(stored_.map, {tile});
  }
  for (std::size_t n = 0; n < rows_.size(); ++n) {
    if (hasMoved(n)) change.moveScan(recordOf(corrector_.journal().at(n), rows_[n]));
  }
  if (moved() > 0) putDrive(change, drive);
}

void FileCorrection::putDrive(MapFile::Change& change, const std::string& drive) const {
  std::set<GridIndex> touched;
  std::uint64_t scans = 0;
  for (std::size_t n = 0; n < rows_.size(); ++n) {
    if (rows_[n].drive != drive) continue;
    const JournalScan& scan = corrector_.journal().at(n);
    touched.insert(scan.regions.begin(), scan.regions.end());
    ++scans;
  }
  Eigen::AlignedBox3d bounds = boundsIn(stored_.map, {touched.begin(), touched.end()});
  for (DriveRecord record : stored_.drives) {
    if (record.id != drive) continue;
    if (record.scans != scans) bounds.extend(record.bounds);  // of scans that the journal lacks
    record.bounds = bounds;
    change.putDrive(record);
  }
}

std::size_t FileCorrection::moved() const {
  std::size_t count = 0;
  for (std::size_t n = 0; n < before_.size(); ++n) count += hasMoved(n);
  return count;
}

double FileCorrection::largestMove() const {
  return corrector_.progress().largest_move;
}

std::vector<GridIndex> FileCorrection::add(const SemanticMap& difference) {
  stored_.map.add(difference);
  for (const GridIndex& region : difference.regions()) changed_.insert(region);
  const MapCorrector::Progress now = corrector_.progress();
  if (progress_) progress_(now.moved, now.moved + now.to_go);
  return {};
}

bool FileCorrection::hasMoved(std::size_t n) const {
  return corrector_.journal().at(n).T_map_sensor.matrix() != before_[n].matrix();
}

}  // namespace bki_mapping
