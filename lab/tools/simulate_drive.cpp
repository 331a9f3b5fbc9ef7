// Writes a simulated drive as a folder in the layout of SemanticKITTI or of the DynamicMap benchmark.
#include <iostream>

#include <filesystem>

#include "sequence/trajectory_file.h"
#include "simulation/drive_file.h"
#include "simulation/truth_cloud.h"
#include "tools/options.h"
#include "tools/sequence_options.h"

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
      "sit down, trolleys, gates; queue: cars that creep; rooms: furnished rooms along a corridor, people, "
      "doors")(
      "trajectory", tools::textOption("FILE"),
      "poses of the sensor, one for each scan, along which a street is laid out; --scene and --speed do not "
      "apply")(
      "calib", tools::textOption("FILE"),
      "file whose line Tr: leads from the lidar to the camera, for a trajectory of the camera; default: "
      "calib.txt beside the trajectory")("poses-in", po::value<std::string>()->value_name("camera|lidar"),
                                         "which sensor the trajectory is of; default: the camera, as in "
                                         "KITTI, and the lidar if poses have stamps")(
      "scans", po::value<int>()->value_name("N"),
      "number of scans; default: 100, or all poses of the trajectory")(
      "lidar", tools::textOption("NAME"),
      "rows of the lidar: hdl64, hdl32 or vlp16; default: hdl64, in rooms vlp16")(
      "beams", po::value<int>()->value_name("N"), "number of rows, spread over the same angles")(
      "columns", tools::optionWith("N", lidar.columns), "azimuth steps per revolution")(
      "rate", tools::optionWith("HZ", lidar.rate), "revolutions per second")(
      "max-range", tools::optionWith("M", lidar.max_range), "range beyond which there is no return [m]")(
      "range-noise", tools::optionWith("M", lidar.range_noise), "standard deviation of the ranges [m]")(
      "label-noise", tools::optionWith("FRACTION", lidar.label_noise),
      "fraction of points with a wrong label")("speed", po::value<double>()->value_name("M/S"),
                                               "speed of the drive [m/s]; default: 8, in traffic 3, in a "
                                               "crowd 2, among arrivals 1, in a queue and in rooms 0.5")(
      "height", po::value<double>()->value_name("M"),
      "height of the sensor above the ground [m]; default: 1.73, in rooms 0.35")(
      "weather", tools::textOption("KIND,RATE")->default_value("dry"),
      "dry; rain or snow and its water [mm/h], such as rain,10; fog or dust and how far one sees [m], such "
      "as "
      "fog,50")("particle-labels", tools::textOption("NAME")->default_value("vegetation"),
                "label of drops, flakes, fog, dust and steam: vegetation, car, person, unlabelled, mixed, or "
                "airborne, a class of their own (raw label 110)")("steam", po::bool_switch(),
                                                                  "cars that move leave steam behind")(
      "glass", po::bool_switch(), "houses have windows, which beams pass or are mirrored by")(
      "layout", tools::textOption("NAME")->default_value("semantic_kitti"),
      "semantic_kitti, or dynamic_map: pcd/ and gt_cloud.pcd, as the DynamicMap benchmark has them")(
      "seed", tools::countOption("--seed", 0)->value_name("N")->default_value(1),
      "seed of the street and of the noise");
  return options;
}

/// The poses of --trajectory. @throws std::invalid_argument if other options contradict it.
LidarPoses lidarPoses(const po::variables_map& given) {
  for (const char* name : {"scene", "speed"}) {
    if (!given.count(name) || given[name].defaulted()) continue;
    throw std::invalid_argument("--" + std::string(name) + " cannot be given with --trajectory, which says " +
                                "where the sensor is at each scan; leave it out");
  }
  const std::string path = given["trajectory"].as<std::string>();
  const std::string beside = (std::filesystem::path(path).parent_path() / "calib.txt").string();
  return readLidarPoses(path, given.count("calib") ? given["calib"].as<std::string>() : beside,
                        tools::posesIn(given));
}

simulation::DriveConfig driveConfig(const po::variables_map& given, const LidarPoses& trajectory) {
  using simulation::SceneKind;
  simulation::DriveConfig drive = simulation::usualDrive(
      given.count("trajectory") ? SceneKind::kTrajectory
                                : simulation::sceneKindNamed(given["scene"].as<std::string>()));
  drive.trajectory = trajectory.poses;
  if (!drive.trajectory.empty()) drive.scans = static_cast<int>(drive.trajectory.size());
  if (given.count("scans")) drive.scans = given["scans"].as<int>();
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
  simulation::setWeather(given["weather"].as<std::string>(), drive.weather);
  drive.weather.labels = simulation::particleLabelsNamed(given["particle-labels"].as<std::string>());
  drive.weather.steam = given["steam"].as<bool>();
  drive.weather.glass = given["glass"].as<bool>();
  return drive;
}

SequenceLayout layoutNamed(const std::string& name) {
  if (name == "semantic_kitti") return SequenceLayout::kSemanticKitti;
  if (name == "dynamic_map") return SequenceLayout::kDynamicMap;
  throw std::invalid_argument("there is no layout " + name + "; known layouts: semantic_kitti, dynamic_map");
}

int simulate(const po::variables_map& given) {
  LidarPoses trajectory;
  if (given.count("trajectory")) {
    trajectory = lidarPoses(given);
  } else if (given.count("calib") || given.count("poses-in")) {
    throw std::invalid_argument("--calib and --poses-in are for --trajectory; give one, or leave them out");
  }
  const simulation::DriveConfig config = driveConfig(given, trajectory);
  const simulation::Drive drive(config);
  const std::string folder = given["output"].as<std::string>();
  const SequenceLayout layout = layoutNamed(given["layout"].as<std::string>());
  SequenceWriter writer(folder, layout, trajectory.T_camera_sensor);
  TruthCloud truth;
  std::size_t points = 0;
  for (std::size_t i = 0; i < drive.size(); ++i) {
    SequenceFrame frame = drive.frame(i);
    // In the frame of the trajectory, so that other poses in this frame fit the scans.
    if (!config.trajectory.empty() && layout == SequenceLayout::kSemanticKitti)
      frame.T_map_sensor = drive.T_world_sensor(i);
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
