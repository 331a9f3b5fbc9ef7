/// @file Time of a scan against the size of the map, the number of points and the resolution, on simulated
/// drives.
#pragma once

#include <map>
#include <string>
#include <vector>

namespace bki_mapping::benchmark {

/// Settings to be timed, with their name in the tables.
struct Case {
  std::string name;
  std::map<std::string, std::string> settings;
};

inline std::vector<Case> modeCases() {
  return {
      {"none", {{"free_space/mode", "none"}}},
      {"linear, 1 sample", {{"free_space/mode", "linear"}}},
      {"linear, 5 samples", {{"free_space/mode", "linear"}, {"free_space/samples_per_beam", "5"}}},
      {"uniform, 1 sample", {{"free_space/mode", "uniform"}}},
      {"even, gap 1 m", {{"free_space/mode", "even"}}},
      {"line, bilinear, mapped", {{"free_space/extent", "mapped"}}},
      {"line, bilinear, observed", {{"free_space/extent", "observed"}}},
  };
}

/// Measures the curves, and every mode on a 128-beam sensor, with two threads. Writes growth.csv, points.csv,
/// resolution.csv and sensor.csv to a folder, which it creates if missing, and draws the first three as PNG
/// by plot_curves.py.
/// @param scans length of the drive during which the map grows.
/// @throws std::runtime_error if a file cannot be written or the plots cannot be drawn.
void measureCurves(const std::string& folder, std::size_t scans);

}  // namespace bki_mapping::benchmark
