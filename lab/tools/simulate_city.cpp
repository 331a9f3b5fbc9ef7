// Writes simulated drives through one city, each as a sequence, and city.yaml, from which map_city maps them.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <string>

#include "core/atomic_file.h"
#include "simulation/city.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
namespace fs = std::filesystem;
namespace po = tools::po;

po::options_description options() {
  const simulation::CityConfig city;
  const simulation::LidarConfig& lidar = city.drive.lidar;
  po::options_description options("Options");
  options.add_options()("output", po::value<std::string>()->value_name("DIR")->required(), "output folder")(
      "drives", tools::optionWith("N", city.drives), "number of drives")(
      "blocks", tools::optionWith("N", city.blocks), "blocks of houses along each side of the city")(
      "block-edge", tools::optionWith("M", city.block_edge),
      "distance between the axes of parallel streets [m]")("scans", tools::optionWith("N", city.drive.scans),
                                                           "number of scans of each drive")(
      "speed", tools::optionWith("M/S", city.drive.speed), "speed of the drives [m/s]")(
      "lidar", tools::textOption("NAME")->default_value("hdl64"), "rows of the lidar: hdl64, hdl32 or vlp16")(
      "beams", po::value<int>()->value_name("N"), "number of rows, spread over the same angles")(
      "columns", tools::optionWith("N", lidar.columns), "azimuth steps per revolution")(
      "rate", tools::optionWith("HZ", lidar.rate), "scans per second")(
      "max-range", tools::optionWith("M", lidar.max_range), "range beyond which there is no return [m]")(
      "range-noise", tools::optionWith("M", lidar.range_noise), "standard deviation of the ranges [m]")(
      "label-noise", tools::optionWith("FRACTION", lidar.label_noise),
      "fraction of points with a wrong label")(
      "seed", tools::countOption("--seed", 0)->value_name("N")->default_value(1),
      "seed of the city, the drives and the noise");
  return options;
}

simulation::CityConfig cityConfig(const po::variables_map& given) {
  simulation::CityConfig city;
  city.drives = given["drives"].as<int>();
  city.blocks = given["blocks"].as<int>();
  city.block_edge = given["block-edge"].as<double>();
  city.drive.scans = given["scans"].as<int>();
  city.drive.speed = given["speed"].as<double>();
  city.drive.seed = tools::count(given, "seed");
  simulation::LidarConfig& lidar = city.drive.lidar;
  lidar = simulation::lidarNamed(given["lidar"].as<std::string>());
  if (given.count("beams")) lidar.beams = given["beams"].as<int>();
  lidar.columns = given["columns"].as<int>();
  lidar.rate = given["rate"].as<double>();
  lidar.max_range = given["max-range"].as<double>();
  lidar.range_noise = given["range-noise"].as<double>();
  lidar.label_noise = given["label-noise"].as<double>();
  return city;
}

int simulate(const po::variables_map& given) {
  const simulation::City city(cityConfig(given));
  const fs::path folder = given["output"].as<std::string>(), list = folder / "city.yaml";
  if (fs::exists(list))
    throw std::runtime_error(list.string() + " exists; give a new folder, or remove the old drives first");
  std::string drives = "drives:\n";
  const std::size_t scans = static_cast<std::size_t>(given["scans"].as<int>());
  for (std::size_t d = 0; d < city.size(); ++d) {
    char name[32];
    std::snprintf(name, sizeof(name), "drive_%04zu", d);
    const simulation::CityDrive drive = city.drive(d);
    SequenceWriter writer((folder / name).string());
    for (std::size_t i = 0; i < drive.size(); ++i) {
      writer.write(drive.frame(i));
      tools::showProgress(d * scans + i + 1, city.size() * scans, "scans");
    }
    writer.finish();
    drives += "  - sequence: " + std::string(name) + "\n";
  }
  writeTextFile(list.string(), "classes: semantic_kitti\n" + drives);
  std::cout << city.size() << " drives of " << scans << " scans, in " << list.string() << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "simulate_city",
                    "Writes simulated drives through one city, with raw labels of SemanticKITTI.", options(),
                    simulate);
}
