#include "journal/corrected_file.h"

#include <filesystem>
#include <map>
#include <stdexcept>
#include <utility>

#include "bki_mapping/store/mapper_file.h"
#include "core/atomic_file.h"
#include "core/counted.h"
#include "journal/file_correction.h"

namespace bki_mapping {
namespace {

using ScansByDrive = std::map<std::string, std::vector<ScanRecord>>;

/// The scans of the journal by their drives. @throws MapFileError if there are none.
ScansByDrive scansByDrive(MapFile& file) {
  if (!file.hasJournal()) {
    throw MapFileError(file.path() +
                       " has no journal of scans, since it has an older version of the format; map the scans "
                       "again with a journal (map_sequence --journal)");
  }
  ScansByDrive scans;
  for (ScanRecord& scan : file.scans()) scans[scan.drive].push_back(std::move(scan));
  if (scans.empty()) {
    throw MapFileError(
        file.path() + " has no scans in its journal; map them again with a journal (map_sequence --journal)");
  }
  return scans;
}

/// The drive that is to be corrected, with its scans. @param id "": the only drive.
const ScansByDrive::value_type& chosenDrive(const ScansByDrive& scans, const std::string& id,
                                            const std::string& path) {
  std::string names;
  for (const auto& [drive, its_scans] : scans) names += (names.empty() ? "'" : ", '") + drive + "'";
  if (id.empty()) {
    if (scans.size() == 1) return *scans.begin();
    throw std::invalid_argument("the journal of " + path + " has scans of " + counted(scans.size(), "drive") +
                                "; name the one whose scans move (drive): " + names);
  }
  const auto found = scans.find(id);
  if (found != scans.end()) return *found;
  throw std::invalid_argument("the journal of " + path + " has no scans of drive '" + id +
                              "'; it has those of " + names);
}

void checkParts(MapFile& file, const std::string& drive) {
  for (const DriveRecord& record : file.drives()) {
    if (record.id != drive || record.part == 0) continue;
    throw MapFileError(file.path() + " also stores drive '" + drive +
                       "' separately, where its scans cannot be moved; correct the map before it is merged");
  }
}

/// Adds the drives of a file, and the tiles of its parts from a number on, to a new file.
void copyParts(MapFile& file, int first_part, MapFile::Change& copy) {
  for (const DriveRecord& drive : file.drives()) copy.putDrive(drive);
  for (const int part : file.parts()) {
    if (part < first_part) continue;
    for (const TileEntry& tile : file.tiles(part)) {
      SemanticMap map = file.info().emptyMap();
      file.addTileTo(map, {tile.index, part});
      copy.writeTile(map, {tile.index, part});
    }
  }
}

/// Whether the file itself is to be changed. @param what the result is, for errors.
bool isInPlace(const std::string& path, const std::string& output, const std::string& what) {
  if (!output.empty() && !isMapFileName(output)) {
    throw std::invalid_argument(what + ", " + output + ", must end in .bkm");
  }
  std::error_code missing;
  const bool in_place =
      output.empty() || output == path || std::filesystem::equivalent(path, output, missing);
  if (!in_place) checkWritable(output);
  return in_place;
}

MapFile openFile(const std::string& path, bool in_place) {
  return MapFile(path, in_place ? MapFile::Access::kUpdate : MapFile::Access::kRead);
}

}  // namespace

CorrectedFile correctMapFile(const std::string& path, const CorrectionOrder& order) {
  const bool in_place = isInPlace(path, order.output, "the corrected map");
  MapFile file = openFile(path, in_place);
  const ScansByDrive scans = scansByDrive(file);
  const auto& [drive, its_scans] = chosenDrive(scans, order.drive, path);
  checkParts(file, drive);
  const std::vector<Eigen::Isometry3d> wanted = order.wanted(its_scans);
  FileCorrection correction(file, order.tolerance);
  CorrectedFile result;
  result.warning = correction.move(drive, wanted, order.progress);
  if (in_place) {
    MapFile::Change change = file.change();
    correction.write(change, drive, false);
    change.commit();
  } else {
    NewMapFile copy(order.output, file.info());
    copyParts(file, 1, copy.content());
    copyJournal(file, copy.content());
    correction.write(copy.content(), drive, true);
    copy.commit();
  }
  result.drive = drive;
  result.scans = its_scans.size();
  result.moved = correction.moved();
  result.tiles = correction.changed().size();
  result.largest_move = correction.largestMove();
  return result;
}

ForgottenScans forgetJournalOfFile(const std::string& path, const std::string& output) {
  const bool in_place = isInPlace(path, output, "the map without a journal");
  MapFile file = openFile(path, in_place);
  ForgottenScans forgotten;
  for (const ScanRecord& scan : file.scans()) {
    ++forgotten.scans;
    forgotten.bytes += scan.bytes;
  }
  if (in_place) {
    MapFile::Change change = file.change();
    change.eraseJournal();
    change.commit();
  } else {
    NewMapFile copy(output, file.info());
    copyParts(file, 0, copy.content());
    copy.commit();
  }
  return forgotten;
}

}  // namespace bki_mapping
