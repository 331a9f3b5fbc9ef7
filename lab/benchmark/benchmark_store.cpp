// A long drive with a window and a map file: memory and times by the kilometre. Then the whole map, loaded
// and saved.
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <vector>

#include "bki_mapping/store/map_keeper.h"
#include "bki_mapping/store/mapper_file.h"
#include "core/quantile.h"
#include "core/stopwatch.h"
#include "simulation/lidar.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

constexpr double kMetresPerScan = 1.0;
constexpr double kMega = 1e6;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("map-file", po::value<std::string>()->value_name("FILE.bkm")->required(),
                        "map file to create")(
      "kilometres", tools::countOption("--kilometres", 1, 10000)->value_name("N")->default_value(10),
      "length of the drive")(
      "street", tools::countOption("--street", 100, 100000)->value_name("M")->default_value(1250),
      "length of the street [m]; the drive goes to and fro")(
      "window", tools::realOption("--window", 0.0)->value_name("M")->default_value(120.0),
      "edge of the window [m]; 0: the whole map stays in memory")(
      "save-every", tools::countOption("--save-every", 1)->value_name("N")->default_value(600),
      "scans between two saves");
  options.add(tools::mapperOptions());
  return options;
}

/// Resident memory of this process [bytes].
double residentMemory() {
  std::size_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

/// The scan of the street at a step of the drive, which turns back at its ends.
std::size_t placeOf(std::size_t step, std::size_t places) {
  const std::size_t lap = step / places, along = step % places;
  return lap % 2 == 0 ? along : places - 1 - along;
}

void driveAlong(const po::variables_map& given) {
  const auto places = tools::count(given, "street"), steps = 1000 * tools::count(given, "kilometres");
  simulation::DriveConfig street;
  street.scans = static_cast<int>(places);
  street.lidar.beams = 16;
  street.lidar.columns = 900;
  street.speed = kMetresPerScan * street.lidar.rate;
  const simulation::Drive drive(street);
  SemanticMapper mapper(tools::mapperConfig(given), tools::classTable(given));
  DriveRecord record;
  record.id = "a drive to and fro";
  MapKeeper keeper(mapper, given["map-file"].as<std::string>(), mapInfoOf(mapper, "map"), record);
  MapKeeper::Window window;
  if (const double edge = given["window"].as<double>(); edge > 0.0) window.edge = edge;
  std::cout << "   km  memory [MB]  map [MB]  waiting [MB]  scan: median [ms]  99 % [ms]  moving tiles: 99 % "
               "[ms]\n";
  std::vector<double> times, moves;
  for (std::size_t step = 0; step < steps; ++step) {
    Scan scan = drive.frame(placeOf(step, places)).scan();
    scan.stamp = 100'000'000 * (step + 1);
    Stopwatch watch;
    mapper.integrate(scan);
    times.push_back(watch.lap());
    keeper.addScan(scan.stamp);
    window.centre = scan.origin;
    keeper.moveTo(window);
    if ((step + 1) % tools::count(given, "save-every") == 0) keeper.save();
    moves.push_back(watch.lap());
    times.back() += moves.back();
    if ((step + 1) % 1000 != 0) continue;
    std::cout << std::fixed << std::setprecision(1) << std::setw(5) << (step + 1) / 1000 << std::setw(13)
              << residentMemory() / kMega << std::setw(10) << static_cast<double>(mapper.mapBytes()) / kMega
              << std::setw(14) << static_cast<double>(keeper.waitingBytes()) / kMega << std::setw(19)
              << quantile(times, 0.5) << std::setw(11) << quantile(times, 0.99) << std::setw(25)
              << quantile(moves, 0.99) << std::endl;
    times.clear();
    moves.clear();
  }
  const std::string lost = keeper.close();
  if (!lost.empty()) throw std::runtime_error(lost);
}

/// Prints how fast a map of this size is loaded and saved.
void loadAndSave(const std::string& path) {
  Stopwatch watch;
  const StoredMap stored = loadMap(path);
  const double load_ms = watch.lap(), bytes = static_cast<double>(stored.map.bytes());
  const std::string copy = path + ".copy.bkm";
  saveMap(copy, stored.info, stored.drives, stored.map);
  const double save_ms = watch.lap();
  const auto size = static_cast<double>(std::ifstream(copy, std::ios::ate | std::ios::binary).tellg());
  unlink(copy.c_str());
  std::cout << "map: " << bytes / kMega << " MB in memory, " << size / kMega << " MB in the file; loaded at "
            << bytes / kMega / load_ms * 1e3 << " MB/s, saved at " << bytes / kMega / save_ms * 1e3
            << " MB/s of memory\n";
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run("benchmark_store", [&] {
    const auto given = tools::parse(
        argc, argv, "Measures a long drive with a window and a map file, by the kilometre.", options());
    if (!given) return 0;
    driveAlong(*given);
    loadAndSave((*given)["map-file"].as<std::string>());
    return 0;
  });
}
