/// @file Time of a scan against the size of the map, the number of points and the resolution, on simulated
/// drives.
#pragma once

#include <string>

namespace bki_mapping::benchmark {

/// Measures the curves, and every mode on a 128-beam sensor, with two threads. Writes growth.csv, points.csv,
/// resolution.csv and sensor.csv to a folder, which it creates if missing, and draws the first three as PNG
/// by plot_curves.py.
/// @param scans length of the drive during which the map grows.
/// @throws std::runtime_error if a file cannot be written or the plots cannot be drawn.
void measureCurves(const std::string& folder, std::size_t scans);

}  // namespace bki_mapping::benchmark
