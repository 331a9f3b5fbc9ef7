// Maps a sequence in SemanticKITTI's layout without ROS, and writes a map file and a report.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <utility>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/sequence/sequence.h"
#include "bki_mapping/settings/yaml.h"
#include "core/atomic_file.h"
#include "core/counted.h"
#include "export/cleaned_points.h"
#include "journal/stored_journal.h"
#include "settings/label_watch.h"
#include "store/drives.h"
#include "tools/interruption.h"
#include "tools/map_output.h"
#include "tools/run_report.h"
#include "tools/sequence_options.h"
#include "tools/trajectory_updates.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

/// The frame of the maps of sequences.
constexpr char kFrame[] = "map";

po::options_description options() {
  po::options_description options("Options");
  tools::addMapOutput(options);
  options.add_options()("resume", tools::textOption("FILE.bkm"), "continue the map in this file")(
      "drive", tools::textOption("ID"),
      "id of these scans in the map file (default: name of the sequence's folder, first and last scan)")(
      "allow-overlap", po::bool_switch(),
      "map scans that by its ids the continued map already holds; they count twice then")(
      "poses", tools::textOption("FILE"),
      "poses in the frame of the map, as matrices or with stamps; "
      "default: poses.txt, relative to its first pose")(
      "points", tools::textOption("FILE.pcd"),
      "file for the points of the scans that lie in occupied voxels of the final map")(
      "report", tools::textOption("FILE.json"), "report of the run")(
      "print-config", po::bool_switch(), "print the effective parameters as YAML, and exit")(
      "print-classes", po::bool_switch(), "print the file of the class table, and exit");
  tools::addJournal(options);
  tools::addTrajectoryUpdates(options);
  options.add(tools::sequenceOptions()).add(tools::mapperOptions());
  return options;
}

/// Scans that have moved may have left the bounds of their drive.
void extendBounds(DriveRecord& drive, const ScanJournal& journal, const SemanticMap& map) {
  for (ScanJournal::Number n = journal.begin(); n < journal.end(); ++n) {
    const JournalScan& scan = journal.at(n);
    if (scan.T_map_sensor.matrix() == scan.T_odometry_sensor.matrix()) continue;
    drive.bounds.extend(boundsIn(map, scan.regions));
  }
}

std::string progressText(const tools::ScanReport& scan) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << scan.stats.totalMs() << " ms";
  return text.str();
}

/// The id of a drive, which depends only on its scans, so that no map holds them twice.
std::string driveId(const po::variables_map& given, const Sequence& sequence, std::size_t first,
                    std::size_t last) {
  if (given.count("drive")) return given["drive"].as<std::string>();
  const std::filesystem::path folder = std::filesystem::canonical(given["sequence"].as<std::string>());
  return folder.filename().string() + "/" + sequence.name(first) + "-" + sequence.name(last - 1);
}

/// Warns that the continued map holds only the sum of drives that the given map stores separately.
void warnOfParts(const std::string& path) {
  for (const DriveRecord& drive : MapFile(path, MapFile::Access::kRead).drives()) {
    if (drive.part == 0) continue;
    std::cerr << "warning: " << path
              << " stores drives separately, and the continued map will not; to keep them separate, map the "
                 "new scans without --resume, and add them with merge_maps --keep-drives\n";
    return;
  }
}

/// Loads the map that is continued. @param added the drive that will be added.
/// @return the drives in the map. @throws std::invalid_argument if it holds that drive or scans of it
/// already.
std::vector<DriveRecord> resume(SemanticMapper& mapper, const std::string& path, const DriveRecord& added,
                                bool allow_overlap) {
  StoredMap stored = loadMapFor(mapper, path, kFrame);
  for (const DriveRecord& drive : stored.drives) {
    if (drive.id == added.id) {
      throw std::invalid_argument("the map in " + path + " already holds drive '" + added.id +
                                  "'; give other scans, or another id with --drive");
    }
    const auto shared = allow_overlap ? std::nullopt : sharedScans(drive, added);
    if (!shared) continue;
    throw std::invalid_argument("by its ids, the map in " + path + " already holds " + textOf(*shared) +
                                ", in drive '" + drive.id +
                                "', which would count twice; give other scans, or, if they are different "
                                "scans, go on with --allow-overlap");
  }
  mapper.addMap(std::move(stored.map));
  return stored.drives;
}

/// The id of a half-open range of the scans of a drive. @param whole the id of all of it.
std::string idOfScans(const std::string& whole, const Sequence& sequence, std::size_t first,
                      std::size_t last) {
  const auto scans = scansOf(whole);
  return (scans ? scans->sequence : whole) + "/" + sequence.name(first) + "-" + sequence.name(last - 1);
}

/// The id of a drive of which only a part has been mapped. @param whole the id of all of it, which stays if
/// the map holds another drive with the id of the part.
std::string idOfPart(const Sequence& sequence, std::size_t first, std::size_t end,
                     const std::vector<DriveRecord>& drives, const std::string& whole) {
  const std::string id = idOfScans(whole, sequence, first, end);
  const auto has_id = [&](const DriveRecord& drive) { return drive.id == id; };
  return std::any_of(drives.begin(), drives.end(), has_id) ? whole : id;
}

/// How far a stopped run has come, and how to map the rest.
std::string stoppedText(const po::variables_map& given, const Sequence& sequence, std::size_t first,
                        std::size_t end, std::size_t last) {
  std::string text = "stopped after scan " + sequence.name(end - 1) + ", " + std::to_string(end - first) +
                     " of " + counted(last - first, "scan");
  if (!tools::writesMapFile(given)) return text;
  return text + "; to map the rest, say --first " + std::to_string(sequence.number(end)) +
         (given.count("scans") ? " --scans " + std::to_string(last - end) : "") + " --resume " +
         given["output"].as<std::string>() +
         (given.count("drive")
              ? " --drive " + idOfScans(given["drive"].as<std::string>(), sequence, end, last)
              : "");
}

int mapSequence(const po::variables_map& given) {
  if (given["print-config"].as<bool>()) {
    std::cout << parameterYaml(tools::mapperConfig(given));
    return 0;
  }
  if (given["print-classes"].as<bool>()) {
    std::cout << std::ifstream(classTableFile(given["classes"].as<std::string>())).rdbuf();
    return 0;
  }
  tools::checkMapOutput(given);
  if (given.count("points")) checkPointFileName(given["points"].as<std::string>());
  for (const char* file : {"points", "report"}) {
    if (given.count(file)) checkWritable(given[file].as<std::string>());
  }
  const tools::Interruption interruption;
  SemanticMapper mapper(tools::mapperConfig(given), tools::classTable(given));
  const Sequence sequence = tools::openSequence(given);
  const auto [first, last] = tools::frameRange(given, sequence);
  tools::warnOfPoses(given, first, last);
  DriveRecord drive;
  drive.id = driveId(given, sequence, first, last);
  drive.name = sequence.folder();
  std::vector<DriveRecord> drives;
  JournalOutput kept;
  if (given.count("resume")) {
    const std::string path = given["resume"].as<std::string>();
    DriveRecord planned = drive;
    planned.scans = last - first;
    planned.first_stamp = sequence.stamp(first);
    planned.last_stamp = sequence.stamp(last - 1);
    drives = resume(mapper, path, planned, given["allow-overlap"].as<bool>());
    if (given.count("output")) warnOfParts(path);
    if (tools::writesMapFile(given)) kept.continued = withJournal(path, given["output"].as<std::string>());
  }

  const auto journal = tools::JournalledMapping::begin(given, mapper);
  std::vector<tools::ScanReport> scans;
  std::vector<std::size_t> mapped;
  std::size_t refused = 0, end = first;
  LabelWatch labels;
  for (; end < last && !interruption.requested(); ++end) {
    try {
      const SequenceFrame frame = sequence.read(end);
      const Scan scan = frame.scan();
      scans.push_back(
          {sequence.name(end), journal ? journal->integrate(sequence, end, frame) : mapper.integrate(scan)});
      mapped.push_back(end);
      tools::warn(labels.report(mapper, scan, scans.back().stats.counts));
      drive.addScan(scan.stamp, mapper.map().geometry(), mapper.touchedBlocks());
    } catch (const ScanRefused& refusal) {
      // Report the first refusal and count the others, which mostly have the same reason.
      if (refused++ == 0)
        std::cerr << "map_sequence: scan " << sequence.name(end) << ": " << refusal.what() << "\n";
      continue;
    }
    tools::showProgress(scans.size(), last - first, progressText(scans.back()));
  }
  const bool stopped = end < last;
  if (journal) journal->finish();
  if (stopped && end == first) {
    throw tools::Stopped("stopped before the first scan; nothing was written");
  }
  if (stopped) drive.id = idOfPart(sequence, first, end, drives, drive.id);
  if (journal) extendBounds(drive, journal->kept().corrector().journal(), mapper.map());
  if (tools::writesMapFile(given) && drive.scans > 0) drives.push_back(drive);
  if (given.count("journal")) kept.kept = &journal->kept();
  kept.drive = drive.id;
  tools::writeMap(given, mapper, kFrame, drives, std::move(kept));
  std::size_t cleaned = mapped.size();
  if (given.count("points")) {
    const std::string path = given["points"].as<std::string>();
    const CleanedCount count =
        writeCleanedPoints(path, sequence, mapped, mapper.map(), mapper.rules(), [&](std::size_t done) {
          tools::showProgress(done, mapped.size(), "scans cleaned");
          return stopped || !interruption.requested();
        });
    std::cout << path << ": " << count.kept << " of " << count.points << " points\n";
    cleaned = count.scans;
  }
  if (given.count("report"))
    writeTextFile(given["report"].as<std::string>(), tools::reportJson(mapper, scans));
  std::cout << tools::summaryText(mapper, scans);
  if (journal) std::cout << journal->summary();
  if (refused > 0) {
    std::cerr << "map_sequence: " << refused << " of " << counted(end - first, "scan")
              << (refused == 1 ? " was" : " were") << " refused\n";
  }
  if (stopped) throw tools::Stopped(stoppedText(given, sequence, first, end, last));
  if (cleaned < mapped.size()) {
    throw tools::Stopped("stopped after the map was complete; " + given["points"].as<std::string>() +
                         " holds the points of " + std::to_string(cleaned) + " of " +
                         counted(mapped.size(), "scan"));
  }
  return refused > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "map_sequence", "Maps a sequence in SemanticKITTI's layout.", options(),
                    mapSequence);
}
