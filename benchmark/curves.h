/// @file How the time of a scan grows: with the map, with the points, with the resolution; on simulated
/// drives.
#pragma once

#include <string>

namespace bki_mapping::benchmark {

/// Measures the curves, and every mode on a 128-beam sensor, with two threads. Writes growth.csv, points.csv,
/// resolution.csv and sensor.csv into a folder, made if missing, and draws the first three as PNG with
/// plot_curves.py.
/// @param scans length of the drive over which the map grows.
/// @throws std::runtime_error if a file cannot be written or the plots cannot be drawn.
void measureCurves(const std::string& folder, std::size_t scans);

}  // namespace bki_mapping::benchmark
