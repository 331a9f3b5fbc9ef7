// Writes a simulated drive as a folder in the layout of SemanticKITTI or of the DynamicMap benchmark.
#include <iostream>

#include <filesystem>

#include "simulation/drive_file.h"
#include "simulation/truth_cloud.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  const simulation::LidarConfig lidar;
  po::options_description options("Options");
  options.add_options()("output", po::value<std::string>()->value_name("DIR")->required(), "output folder")(
      "scene", tools::textOption("KIND")->default_value("street"),
      "street: cars that pass or are parked; traffic: stop-and-go, and parked cars that drive off; crowd: "
      "many pedestrians and cyclists; arrivals: cars that come, park and leave, people who stop or "
      "sit down, trolleys, gates")("scans", tools::optionWith("N", 100), "number of scans")(
      "lidar", tools::textOption("NAME")->default_value("hdl64"), "rows of the lidar: hdl64, hdl32 or vlp16")(
      "beams", po::value<int>()->value_name("N"), "number of rows, spread over the same angles")(
      "columns", tools::optionWith("N", lidar.columns), "azimuth steps per revolution")(
      "rate", tools::optionWith("HZ", lidar.rate), "revolutions per second")(
      "max-range", tools::optionWith("M", lidar.max_range), "range beyond which there is no return [m]")(
      "range-noise", tools::optionWith("M", lidar.range_noise), "standard deviation of the ranges [m]")(
      "label-noise", tools::optionWith("FRACTION", lidar.label_noise),
      "fraction of points with a wrong label")(
      "speed", po::value<double>()->value_name("M/S"),
      "speed of the drive [m/s]; default: 8, in traffic 3, in a crowd 2, among arrivals 1")(
      "height", tools::optionWith("M", simulation::DriveConfig().height),
      "height of the sensor above the ground [m]")(
      "layout", tools::textOption("NAME")->default_value("semantic_kitti"),
      "semantic_kitti, or dynamic_map: pcd/ and gt_cloud.pcd, as the DynamicMap benchmark has them")(
      "seed", tools::countOption("--seed", 0)->value_name("N")->default_value(1),
      "seed of the street and of the noise");
  return options;
}

/// [m/s]
double usualSpeed(simulation::SceneKind scene) {
  switch (scene) {
    case simulation::SceneKind::kTraffic:
      return 3.0;
    case simulation::SceneKind::kCrowd:
      return 2.0;
    case simulation::SceneKind::kArrivals:
      return 1.0;
    default:
      return 8.0;
  }
}

simulation::DriveConfig driveConfig(const po::variables_map& given) {
  simulation::DriveConfig drive;
  drive.scans = given["scans"].as<int>();
  drive.scene = simulation::sceneKindNamed(given["scene"].as<std::string>());
  drive.speed = given.count("speed") ? given["speed"].as<double>() : usualSpeed(drive.scene);
  drive.height = given["height"].as<double>();
  drive.seed = tools::count(given, "seed");
  drive.lidar = simulation::lidarNamed(given["lidar"].as<std::string>());
  if (given.count("beams")) drive.lidar.beams = given["beams"].as<int>();
  drive.lidar.columns = given["columns"].as<int>();
  drive.lidar.rate = given["rate"].as<double>();
  drive.lidar.max_range = given["max-range"].as<double>();
  drive.lidar.range_noise = given["range-noise"].as<double>();
  drive.lidar.label_noise = given["label-noise"].as<double>();
  drive.lidar.seed = drive.seed;
  return drive;
}

SequenceLayout layoutNamed(const std::string& name) {
  if (name == "semantic_kitti") return SequenceLayout::kSemanticKitti;
  if (name == "dynamic_map") return SequenceLayout::kDynamicMap;
  throw std::invalid_argument("there is no layout " + name + "; known layouts: semantic_kitti, dynamic_map");
}

int simulate(const po::variables_map& given) {
  const simulation::DriveConfig config = driveConfig(given);
  const simulation::Drive drive(config);
  const std::string folder = given["output"].as<std::string>();
  const SequenceLayout layout = layoutNamed(given["layout"].as<std::string>());
  SequenceWriter writer(folder, layout);
  TruthCloud truth;
  std::size_t points = 0;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    const SequenceFrame frame = drive.frame(i);
    writer.write(frame);
    if (layout == SequenceLayout::kDynamicMap) truth.add(frame.scan());
    points += frame.points.size();
    tools::showProgress(i + 1, drive.size(), "scans");
  }
  writer.finish();
  if (layout == SequenceLayout::kDynamicMap) {
    writeTruthCloud((std::filesystem::path(folder) / "gt_cloud.pcd").string(), truth);
  }
  simulation::writeDriveFile(folder, config);
  std::cout << drive.size() << " scans, " << points / drive.size() << " points a scan, in " << folder << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "simulate_drive",
                    "Writes a simulated drive with raw labels of SemanticKITTI.", options(), simulate);
}
