// Writes a simulated drive as a folder in SemanticKITTI's layout.
#include <iostream>

#include "bki_mapping/simulation/lidar.h"
#include "bki_mapping/tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

/// Names a value for the help text, and sets its default.
template <typename T>
auto value(const char* name, T standard) {
  return po::value<T>()->value_name(name)->default_value(standard);
}

po::options_description options() {
  const simulation::LidarConfig lidar;
  po::options_description options("Options");
  options.add_options()("output", po::value<std::string>()->value_name("DIR")->required(), "folder to write")(
      "scans", value<int>("N", 100), "how many scans")("beams", value("N", lidar.beams), "rows of the lidar")(
      "columns", value("N", lidar.columns), "azimuth steps a turn")(
      "rate", value("HZ", lidar.rate), "turns a second")("max-range", value("M", lidar.max_range),
                                                         "no return beyond this [m]")(
      "range-noise", value("M", lidar.range_noise), "standard deviation of ranges [m]")(
      "label-noise", value("SHARE", lidar.label_noise), "share of points with a wrong label")(
      "speed", value("M/S", 8.0), "speed of the drive [m/s]")("seed", value<std::uint64_t>("N", 1),
                                                              "same seed, same street and noise");
  return options;
}

simulation::LidarConfig lidarConfig(const po::variables_map& given) {
  simulation::LidarConfig lidar;
  lidar.beams = given["beams"].as<int>();
  lidar.columns = given["columns"].as<int>();
  lidar.rate = given["rate"].as<double>();
  lidar.max_range = given["max-range"].as<double>();
  lidar.range_noise = given["range-noise"].as<double>();
  lidar.label_noise = given["label-noise"].as<double>();
  lidar.seed = given["seed"].as<std::uint64_t>();
  if (lidar.beams < 1 || lidar.beams > 1024 || lidar.columns < 1 || lidar.columns > 100000 ||
      !(lidar.rate > 0.0)) {
    throw std::invalid_argument("--beams must be 1 to 1024, --columns 1 to 100000, --rate above 0");
  }
  return lidar;
}

int simulate(const po::variables_map& given) {
  const int scans = given["scans"].as<int>();
  const double speed = given["speed"].as<double>();
  if (scans < 1 || scans > 1000000 || !(speed >= 0.0 && speed <= 100.0)) {
    throw std::invalid_argument("--scans must be 1 to 1000000, --speed 0 to 100");
  }
  const auto count = static_cast<std::size_t>(scans);
  const simulation::Drive drive(count, lidarConfig(given), speed, given["seed"].as<std::uint64_t>());
  SequenceWriter writer(given["output"].as<std::string>());
  std::size_t points = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const SequenceFrame frame = drive.frame(i);
    writer.write(frame);
    points += frame.points.size();
    tools::showProgress(i + 1, count, "scans");
  }
  writer.finish();
  std::cout << count << " scans, " << points / count << " points a scan, in "
            << given["output"].as<std::string>() << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run("simulate_drive", [&] {
    const auto given = tools::parse(
        argc, argv, "Writes a simulated drive in SemanticKITTI's layout (raw labels).", options());
    return given ? simulate(*given) : 0;
  });
}
