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
      "sit down, trolleys, gates; rooms: furnished rooms along a corridor, people, doors")(
      "scans", tools::optionWith("N", 100), "number of scans")(
      "lidar", tools::textOption("NAME"),
      "rows of the lidar: hdl64, hdl32 or vlp16; default: hdl64, in rooms vlp16")(
      "beams", po::value<int>()->value_name("N"), "number of rows, spread over the same angles")(
      "columns", tools::optionWith("N", lidar.columns), "azimuth steps per revolution")(
      "rate", tools::optionWith("HZ", lidar.rate), "revolutions per second")(
      "max-range", tools::optionWith("M", lidar.max_range), "range beyond which there is no return [m]")(
      "range-noise", tools::optionWith("M", lidar.range_noise), "standard deviation of the ranges [m]")(
      "label-noise", tools::optionWith("FRACTION", lidar.label_noise),
      "fraction of points with a wrong label")(
      "speed", po::value<double>()->value_name("M/S"),
      "speed of the drive [m/s]; default: 8, in traffic 3, in a crowd 2, among arrivals 1, in rooms 0.5")(
      "height", po::value<double>()->value_name("M"),
      "height of the sensor above the ground [m]; default: 1.73, in rooms 0.35")(
      "layout", tools::textOption("NAME")->default_value("semantic_kitti"),
      "semantic_kitti, or dynamic_map: pcd/ and gt_cloud.pcd, as the DynamicMap benchmark has them")(
      "seed", tools::countOption("--seed", 0)->value_name("N")->default_value(1),
      "seed of the street and of the noise");
  return options;
}

simulation::DriveConfig driveConfig(const po::variables_map& given) {
  simulation::DriveConfig drive =
      simulation::usualDrive(simulation::sceneKindNamed(given["scene"].as<std::string>()));
  drive.scans = given["scans"].as<int>();
  if (given.count("speed")) drive.speed = given["speed"].as<double>();
  if (given.count("height")) drive.height = given["height"].as<double>();
  drive.seed = tools::count(given, "seed");
  if (given.count("lidar")) drive.lidar = simulation::lidarNamed(given["lidar"].as<std::string>());
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
