// Maps scans that are in memory, and keeps the map in a file. Usage: map_drive FILE.bkm
#include <bki_mapping/mapping/semantic_mapper.h>
#include <bki_mapping/settings/yaml.h>
#include <bki_mapping/store/mapper_file.h>

#include <cmath>
#include <iostream>

using namespace bki_mapping;

// What a lidar 1.7 m above a road sees between two walls. A driver and a segmentation would give the points
// in the sensor's frame, their raw labels, and the pose.
Scan scanAt(double x, std::uint64_t stamp) {
  constexpr std::uint32_t kRoad = 40, kBuilding = 50;  // raw labels of SemanticKITTI
  Scan scan;
  scan.origin = {x, 0.0, 1.7};
  scan.stamp = stamp;
  for (double azimuth = 0.0; azimuth < 2.0 * M_PI; azimuth += 0.01) {
    for (double elevation = -0.4; elevation < 0.1; elevation += 0.02) {
      const Eigen::Vector3d beam(std::cos(azimuth), std::sin(azimuth), std::tan(elevation));
      const double to_wall = 6.0 / std::abs(beam.y()), to_road = elevation < 0.0 ? -1.7 / beam.z() : 1e9;
      const double length = std::min(to_wall, to_road);
      if (length > 40.0) continue;
      scan.points.push_back((length * beam).cast<float>());
      scan.labels.push_back(to_wall < to_road ? kBuilding : kRoad);
    }
  }
  return scan;
}

int main(int argc, char** argv) try {
  if (argc != 2) throw std::invalid_argument("give one file for the map: map_drive FILE.bkm");
  MapperConfig config;  // the paper's settings; setParameters() sets them by name
  config.resolution = 0.3;
  const auto classes = std::make_shared<const ClassTable>(loadClassTable("semantic_kitti"));
  SemanticMapper mapper(config, classes);

  DriveRecord drive;
  drive.id = "street 1, 24 May";  // unique, so that a merge counts the drive once
  for (int i = 0; i < 10; ++i) {
    const Scan scan = scanAt(0.8 * i, static_cast<std::uint64_t>(i) * 100'000'000);
    const ScanStats stats = mapper.integrate(scan);
    drive.addScan(scan.stamp, mapper.map().geometry(), mapper.touchedBlocks());
    std::cout << stats.counts.used << " points, " << stats.totalMs() << " ms\n";
  }
  saveMap(argv[1], mapInfoOf(mapper, "map"), {drive}, mapper.map());
  std::cout << argv[1] << ": " << mapper.map().size() << " blocks\n";
} catch (const std::exception& error) {
  std::cerr << "map_drive: " << error.what() << "\n";
  return 1;
}
