// Moves the scans of a drive in a map file to corrected poses.
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <stdexcept>
#include <utility>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/store/mapper_file.h"
#include "core/atomic_file.h"
#include "core/counted.h"
#include "core/stopwatch.h"
#include "journal/file_correction.h"
#include "tools/map_copy.h"
#include "tools/options.h"
#include "tools/scan_poses.h"
#include "tools/sequence_options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("poses", tools::textOption("FILE"),
                        "where the scans belong, in the frame of the map: a matrix for each scan, in order, "
                        "or poses with stamps, between which scans keep the shape of their recorded way")(
      "drive", tools::textOption("ID"), "drive whose scans move; needed if the journal has several")(
      "calib", tools::textOption("FILE"),
      "file with the transform `Tr` from the lidar to the camera, for poses of the camera; default: the "
      "calib.txt beside the poses")(
      "poses-in", tools::textOption("camera|lidar"),
      "which sensor the poses are of; default: the camera, as in KITTI, and the lidar if poses have stamps")(
      "tolerance", tools::realOption("--tolerance", 0.0)->value_name("METRES")->default_value(0.0),
      "scans stay if no point is farther than this from where it belongs")(
      "output", tools::textOption("FILE.bkm"), "file for the result; default: the file itself is changed");
  return options;
}

LidarPoses posesOf(const po::variables_map& given) {
  if (!given.count("poses")) throw std::invalid_argument("--poses FILE is missing (see --help)");
  const std::string path = given["poses"].as<std::string>();
  const std::string beside = (std::filesystem::path(path).parent_path() / "calib.txt").string();
  return readLidarPoses(path, given.count("calib") ? given["calib"].as<std::string>() : beside,
                        tools::posesIn(given));
}

/// The scans of the journal by their drives. @throws MapFileError if there are none.
std::map<std::string, std::vector<ScanRecord>> scansByDrive(MapFile& file) {
  if (!file.hasJournal()) {
    throw MapFileError(file.path() +
                       " has no journal of scans, since it has an older version of the format; map the scans "
                       "again with a journal (map_sequence --journal)");
  }
  std::map<std::string, std::vector<ScanRecord>> scans;
  for (ScanRecord& scan : file.scans()) scans[scan.drive].push_back(std::move(scan));
  if (scans.empty()) {
    throw MapFileError(
        file.path() + " has no scans in its journal; map them again with a journal (map_sequence --journal)");
  }
  return scans;
}

using Drive = std::pair<const std::string, std::vector<ScanRecord>>;

/// The drive that is to be corrected.
const Drive& chosenDrive(const std::map<std::string, std::vector<ScanRecord>>& scans,
                         const po::variables_map& given, const std::string& path) {
  std::string names;
  for (const auto& [drive, its_scans] : scans) names += (names.empty() ? "'" : ", '") + drive + "'";
  if (!given.count("drive")) {
    if (scans.size() == 1) return *scans.begin();
    throw std::invalid_argument("the journal of " + path + " has scans of " + counted(scans.size(), "drive") +
                                "; name one with --drive: " + names);
  }
  const std::string id = given["drive"].as<std::string>();
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

/// Writes the corrected map, to the file itself or to another one.
void writeResult(MapFile& file, const FileCorrection& correction, const std::string& drive,
                 const std::string& output, bool in_place) {
  if (in_place) {
    MapFile::Change change = file.change();
    correction.write(change, drive, false);
    return change.commit();
  }
  NewMapFile copy(output, file.info());
  tools::copyParts(file, 1, copy.content());
  copyJournal(file, copy.content());
  correction.write(copy.content(), drive, true);
  copy.commit();
}

int correctMap(const po::variables_map& given) {
  const std::string path = tools::onlyMapFile(given);
  const std::string output = given.count("output") ? given["output"].as<std::string>() : path;
  if (!isMapFileName(output))
    throw std::invalid_argument("the corrected map, " + output + ", must end in .bkm");
  const LidarPoses poses = posesOf(given);
  std::error_code missing;
  const bool in_place = output == path || std::filesystem::equivalent(path, output, missing);
  if (!in_place) checkWritable(output);
  Stopwatch watch;
  MapFile file(path, in_place ? MapFile::Access::kUpdate : MapFile::Access::kRead);
  const auto scans = scansByDrive(file);
  const Drive& drive = chosenDrive(scans, given, path);
  checkParts(file, drive.first);
  const std::vector<Eigen::Isometry3d> wanted =
      tools::wantedPoses(drive.second, poses, given["poses"].as<std::string>());
  FileCorrection correction(file, given["tolerance"].as<double>());
  tools::warn(correction.move(drive.first, wanted, [](std::size_t done, std::size_t all) {
    tools::showProgress(done, all, "scans moved");
  }));
  writeResult(file, correction, drive.first, output, in_place);
  std::cout << output << ": " << correction.moved() << " of " << counted(drive.second.size(), "scan")
            << " of drive '" << drive.first << "' moved, the farthest by "
            << numberText(std::round(1e3 * correction.largestMove()) / 1e3) << " m; "
            << counted(correction.changed().size(), "tile") << " changed, in "
            << numberText(std::round(watch.lap() / 100.0) / 10.0) << " s\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "correct_map",
                    "correct_map FILE.bkm --poses FILE\n"
                    "Moves the scans of a map's journal to corrected poses. The map is then the one that "
                    "these poses would have made.",
                    options(), correctMap, "files");
}
