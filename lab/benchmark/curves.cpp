#include "curves.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/settings/yaml.h"
#include "core/atomic_file.h"
#include "core/quantile.h"
#include "core/stopwatch.h"
#include "simulation/lidar.h"
#include "tools/draw.h"

namespace bki_mapping::benchmark {
namespace {

constexpr double kSpeed = 8.0;                   // of the simulated drives [m/s]
constexpr std::size_t kWarmUp = 3, kTimed = 12;  // scans of a short drive

std::unique_ptr<SemanticMapper> mapperOf(std::map<std::string, std::string> settings) {
  settings["threads"] = "2";
  MapperConfig config;
  setParameters(config, settings);
  return std::make_unique<SemanticMapper>(
      config, std::make_shared<const ClassTable>(loadClassTable("semantic_kitti")));
}

/// Result of a short drive mapped with given settings.
struct ShortRun {
  std::size_t points = 0, hits = 0;  ///< of the last scan
  double median_ms = 0.0, worst_ms = 0.0;
};

ShortRun run(const std::vector<Scan>& scans, const std::map<std::string, std::string>& settings) {
  const auto mapper = mapperOf(settings);
  ShortRun result;
  std::vector<double> times;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    Stopwatch watch;
    const ScanStats stats = mapper->integrate(scans[i]);
    if (i >= kWarmUp) times.push_back(watch.lap());
    result.points = stats.counts.points;
    result.hits = stats.hits;
  }
  result.median_ms = quantile(times, 0.5);
  result.worst_ms = quantile(times, 1.0);
  return result;
}

std::vector<Scan> shortDrive(int beams, int columns) {
  simulation::LidarConfig lidar;
  lidar.beams = beams;
  lidar.columns = columns;
  const simulation::Drive drive({kWarmUp + kTimed, kSpeed, 1, lidar});
  std::vector<Scan> scans;
  for (std::size_t i = 0; i < drive.size(); ++i) scans.push_back(drive.frame(i).scan());
  return scans;
}

const std::vector<Case>& curveCases() {
  static const std::vector<Case> cases = {
      {"none", {{"free_space/mode", "none"}}},
      {"linear, 1 sample", {{"free_space/mode", "linear"}}},
      {"line, bilinear, observed", {{"free_space/extent", "observed"}}},
  };
  return cases;
}

/// A mode in two maps: one that grows during the whole drive, and one that begins with the last scans.
struct GrowingCase {
  explicit GrowingCase(const Case& of)
      : name(of.name), grown(mapperOf(of.settings)), fresh(mapperOf(of.settings)) {}

  std::string name;
  std::unique_ptr<SemanticMapper> grown, fresh;
  std::vector<double> ms_grown, ms_fresh;  ///< of the same scans
};

double millisecondsOf(SemanticMapper& mapper, const Scan& scan) {
  Stopwatch watch;
  mapper.integrate(scan);
  return watch.lap();
}

/// Measures time against the size of the map; the modes map each scan in turn. Prints the time of the last
/// scans in the grown map and in a new one, which separates the size of the map from the differences between
/// streets.
std::string growth(std::size_t count) {
  const simulation::Drive drive({static_cast<int>(count), kSpeed, 1, {}});
  const std::size_t last = std::min<std::size_t>(200, count / 2), begin = count - last;
  std::string csv = "mode,scan,blocks,map_bytes,ms\n";
  std::vector<GrowingCase> all(curveCases().begin(), curveCases().end());
  for (std::size_t i = 0; i < count; ++i) {
    const Scan scan = drive.frame(i).scan();
    for (GrowingCase& c : all) {
      const bool both = i >= begin,
                 fresh_first = i % 2 == 1;  // alternate, because the second one finds the scan in the cache
      double ms_fresh = 0.0;
      if (both && fresh_first) ms_fresh = millisecondsOf(*c.fresh, scan);
      const double ms = millisecondsOf(*c.grown, scan);
      if (both && !fresh_first) ms_fresh = millisecondsOf(*c.fresh, scan);
      csv += '"' + c.name + "\"," + std::to_string(i) + "," + std::to_string(c.grown->map().size()) + "," +
             std::to_string(c.grown->map().bytes()) + "," + std::to_string(ms) + "\n";
      if (i < begin + last / 10) continue;  // the new map is still growing quickly
      c.ms_grown.push_back(ms);
      c.ms_fresh.push_back(ms_fresh);
    }
  }
  for (const GrowingCase& c : all) {
    std::printf("growth, %-26s %6.1f ms in a map of %zu blocks, %6.1f ms in one of %zu\n", c.name.c_str(),
                quantile(c.ms_grown, 0.5), c.grown->map().size(), quantile(c.ms_fresh, 0.5),
                c.fresh->map().size());
  }
  return csv;
}

std::string points() {
  std::string csv = "mode,points,hits,median_ms\n";
  for (const int columns : {450, 900, 1800, 3600}) {
    const std::vector<Scan> scans = shortDrive(64, columns);
    for (const Case& c : curveCases()) {
      const ShortRun r = run(scans, c.settings);
      csv += '"' + c.name + "\"," + std::to_string(r.points) + "," + std::to_string(r.hits) + "," +
             std::to_string(r.median_ms) + "\n";
    }
  }
  return csv;
}

std::string resolution() {
  std::string csv = "mode,resolution,median_ms\n";
  const std::vector<Scan> scans = shortDrive(64, 1800);
  for (const char* edge : {"0.1", "0.15", "0.2", "0.3", "0.4", "0.6"}) {
    for (Case c : curveCases()) {
      c.settings["resolution"] = edge;
      csv += '"' + c.name + "\"," + edge + "," + std::to_string(run(scans, c.settings).median_ms) + "\n";
    }
  }
  return csv;
}

/// A sensor with 128 beams and 2100 columns: 260 thousand points per scan.
std::string sensor() {
  std::string csv = "mode,points,hits,median_ms,worst_ms\n";
  const std::vector<Scan> scans = shortDrive(128, 2100);
  for (const Case& c : modeCases()) {
    const ShortRun r = run(scans, c.settings);
    std::printf("128 beams, %zu points, %-26s %8.1f ms, at most %8.1f ms\n", r.points, c.name.c_str(),
                r.median_ms, r.worst_ms);
    csv += '"' + c.name + "\"," + std::to_string(r.points) + "," + std::to_string(r.hits) + "," +
           std::to_string(r.median_ms) + "," + std::to_string(r.worst_ms) + "\n";
  }
  return csv;
}

}  // namespace

void measureCurves(const std::string& folder, std::size_t scans) {
  std::filesystem::create_directories(folder);
  const auto write = [&folder](const char* name, const std::string& csv) {
    writeTextFile(folder + "/" + name, csv);
    std::printf("%s/%s\n", folder.c_str(), name);
    std::fflush(stdout);
  };
  write("sensor.csv", sensor());
  write("points.csv", points());
  write("resolution.csv", resolution());
  write("growth.csv", growth(scans));
  tools::draw("plot_curves.py", {folder});
}

}  // namespace bki_mapping::benchmark
