// Prints what is in a map file, and draws it.
#include <algorithm>
#include <cmath>
#include <ctime>
#include <iomanip>
#include <iostream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <tuple>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/store/mapper_file.h"
#include "core/atomic_file.h"
#include "core/counted.h"
#include "export/map_picture.h"
#include "export/map_statistics.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("json", tools::textOption("FILE.json"), "also write the figures as JSON")(
      "top", tools::textOption("FILE.png"), "draw the map as seen from above")(
      "profile", tools::textOption("FILE.png"), "draw the map as seen from its longer side")(
      "max-z", po::value<double>()->value_name("M"),
      "draw only voxels up to this height [m], to look below ceilings and trees")(
      "parameters", po::bool_switch(), "print the parameters in the file as YAML, and exit");
  return options;
}

/// The drives by their first scans, since ids may be random; those without scans come last.
std::vector<DriveRecord> drivesByTime(MapFile& file) {
  std::vector<DriveRecord> drives = file.drives();
  std::sort(drives.begin(), drives.end(), [&](const DriveRecord& a, const DriveRecord& b) {
    if ((a.scans == 0) != (b.scans == 0)) return b.scans == 0;
    return std::tie(a.first_stamp, a.id) < std::tie(b.first_stamp, b.id);
  });
  return drives;
}

std::string timeText(std::uint64_t stamp) {
  const auto seconds = static_cast<std::time_t>(stamp / 1'000'000'000);
  std::ostringstream text;
  text << std::put_time(std::gmtime(&seconds), "%Y-%m-%d %H:%M:%S UTC");
  return text.str();
}

void printDrive(std::ostream& out, const DriveRecord& drive) {
  out << "  " << drive.id << ": " << counted(drive.scans, "scan");
  if (drive.scans > 0) {
    out << ", from " << timeText(drive.first_stamp) << ", "
        << 1e-9 * static_cast<double>(drive.last_stamp - drive.first_stamp) << " s";
  }
  if (drive.part > 0) out << ", separate in part " << drive.part;
  out << "\n";
}

/// The line on the journal; none if it is empty.
void printJournal(std::ostream& out, const JournalStatistics& journal) {
  if (journal.scans == 0) return;
  out << "journal: " << counted(journal.scans, "scan") << " of " << counted(journal.drives, "drive")
      << " that can be moved, " << static_cast<double>(journal.bytes) / 1e6 << " MB, "
      << journal.bytes / journal.scans << " bytes a scan\n";
}

void print(std::ostream& out, MapFile& file, const MapStatistics& found, const JournalStatistics& journal) {
  const MapInfo& info = file.info();
  out << file.path() << ", by " << info.program << "\n"
      << "frame " << info.frame << ", resolution " << numberText(info.resolution) << " m, class table "
      << info.classes->name() << "\n"
      << std::fixed << std::setprecision(1);
  const Eigen::AlignedBox3d box = found.bounds(info.resolution);
  if (!box.isEmpty()) {
    for (const Eigen::Index axis : {0, 1, 2}) {
      out << (axis == 0 ? "" : ", ") << "xyz"[axis] << " from " << box.min()[axis] << " to "
          << box.max()[axis];
    }
    out << " m\n";
  }
  out << "voxels: " << found.occupied << " occupied, " << found.free << " free, " << found.occluded
      << " occluded; " << counted(found.blocks, "block") << " in " << counted(found.tiles, "tile") << "\n"
      << "size: " << static_cast<double>(file.size().bytes) / 1e6 << " MB in the file, "
      << static_cast<double>(found.memory_bytes) / 1e6 << " MB in memory";
  if (found.known() > 0) {
    out << ", " << std::setprecision(2) << found.bytesPerKnownVoxel(file.size().bytes)
        << " bytes of the file for each known voxel" << std::setprecision(1);
  }
  out << "\ndrives:\n";
  for (const DriveRecord& drive : drivesByTime(file)) printDrive(out, drive);
  printJournal(out, journal);
  out << "occupied voxels by class:\n";
  for (const auto& [id, count] : found.occupied_by_class) {
    const SemanticClass* known = info.classes->find(id);
    out << "  " << std::setw(20) << std::left << (known ? known->name : "?") << count << "\n";
  }
}

/// The files of --top and --profile, checked before the work.
std::string pictureFile(const po::variables_map& given, const char* option) {
  if (!given.count(option)) return "";
  const std::string path = given[option].as<std::string>();
  if (path.size() < 4 || path.compare(path.size() - 4, 4, ".png") != 0) {
    throw std::invalid_argument(std::string("--") + option + " " + path + " must end in .png");
  }
  checkWritable(path);
  return path;
}

/// The last voxel to be drawn. @param most greatest height of centres, if there is a limit [m].
GridIndex lastDrawn(const MapStatistics& found, double resolution, const std::optional<double>& most) {
  GridIndex last = found.high;
  if (!most || found.low.x > found.high.x) return last;
  const double layer = std::floor(*most / resolution - 0.5);
  if (!(layer >= found.low.z)) {
    throw std::invalid_argument("--max-z " + numberText(*most) +
                                " is below the map; its lowest voxels are at z = " +
                                numberText((found.low.z + 0.5) * resolution) + " m");
  }
  last.z = static_cast<std::int32_t>(std::min<double>(last.z, layer));
  return last;
}

void draw(MapFile& file, const StateRules& rules, const MapStatistics& found, const GridIndex& last,
          const std::string& top, const std::string& profile) {
  std::vector<std::pair<std::string, MapPicture>> pictures;
  if (!top.empty()) pictures.emplace_back(top, MapPicture(MapPicture::View::kTop, found.low, last));
  if (!profile.empty())
    pictures.emplace_back(profile, MapPicture(MapPicture::View::kProfile, found.low, last));
  if (pictures.empty()) return;
  readStatistics(file, rules, [&](const BlockIndex& index, const BlockView& view) {
    for (auto& [path, picture] : pictures) picture.add(index, view);
  });
  for (const auto& [path, picture] : pictures) {
    writePng(path, picture.draw(*file.info().classes));
    std::cout << path << ": " << numberText(file.info().resolution * picture.voxelsPerPixel())
              << " m a pixel\n";
  }
}

int inspect(const po::variables_map& given) {
  const std::string path = tools::onlyMapFile(given);
  MapFile file(path, MapFile::Access::kRead);
  if (given["parameters"].as<bool>()) {
    std::cout << file.info().parameters;
    return 0;
  }
  const std::string top = pictureFile(given, "top"), profile = pictureFile(given, "profile");
  std::optional<double> most;
  if (given.count("max-z")) most = given["max-z"].as<double>();
  if (most && top.empty() && profile.empty()) {
    throw std::invalid_argument("--max-z limits pictures; give --top or --profile as well");
  }
  if (given.count("json")) checkWritable(given["json"].as<std::string>());
  const StateRules rules = storedRules(path, file.info());
  const MapStatistics found = readStatistics(file, rules);
  const GridIndex last = lastDrawn(found, file.info().resolution, most);
  for (const ScanRecord& scan : file.scans()) file.scanContent(scan.number);  // checks it
  const JournalStatistics journal = readJournalStatistics(file);
  print(std::cout, file, found, journal);
  if (given.count("json")) {
    writeTextFile(given["json"].as<std::string>(), statisticsJson(file, found, drivesByTime(file), journal));
  }
  draw(file, rules, found, last, top, profile);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "inspect_map",
                    "inspect_map FILE.bkm\n"
                    "Prints what is in a map file, checks every byte of it, and draws it.",
                    options(), inspect, "files");
}
