// Moves the scans of a drive in a map file to corrected poses.
#include <cmath>
#include <filesystem>
#include <iostream>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"
#include "core/counted.h"
#include "core/stopwatch.h"
#include "journal/corrected_file.h"
#include "journal/scan_poses.h"
#include "tools/options.h"
#include "tools/sequence_options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("poses", tools::textOption("FILE"),
                        "where the scans belong, in the frame of the map: a matrix for each scan, in order, "
                        "or poses with stamps, between which scans keep the shape of their recorded way")(
      "drive", tools::textOption("ID"), "drive whose scans move; needed if the journal has several")(
      "calib", tools::textOption("FILE"),
      "file with the transform `Tr` from the lidar to the camera, for poses of the camera; default: the "
      "calib.txt beside the poses")(
      "poses-in", tools::textOption("camera|lidar"),
      "which sensor the poses are of; default: the camera, as in KITTI, and the lidar if poses have stamps")(
      "tolerance", tools::realOption("--tolerance", 0.0)->value_name("METRES")->default_value(0.0),
      "scans stay if no point is farther than this from where it belongs")(
      "output", tools::textOption("FILE.bkm"), "file for the result; default: the file itself is changed");
  return options;
}

LidarPoses posesOf(const po::variables_map& given) {
  if (!given.count("poses")) throw std::invalid_argument("--poses FILE is missing (see --help)");
  const std::string path = given["poses"].as<std::string>();
  const std::string beside = (std::filesystem::path(path).parent_path() / "calib.txt").string();
  return readLidarPoses(path, given.count("calib") ? given["calib"].as<std::string>() : beside,
                        tools::posesIn(given));
}

int correctMap(const po::variables_map& given) {
  const std::string path = tools::onlyMapFile(given);
  const LidarPoses poses = posesOf(given);
  CorrectionOrder order;
  if (given.count("drive")) order.drive = given["drive"].as<std::string>();
  order.tolerance = given["tolerance"].as<double>();
  order.output = given.count("output") ? given["output"].as<std::string>() : path;
  order.wanted = [&](const std::vector<ScanRecord>& scans) {
    return wantedPoses(scans, poses, given["poses"].as<std::string>());
  };
  order.progress = [](std::size_t done, std::size_t all) { tools::showProgress(done, all, "scans moved"); };
  Stopwatch watch;
  const CorrectedFile corrected = correctMapFile(path, order);
  tools::warn(corrected.warning);
  std::cout << order.output << ": " << corrected.moved << " of " << counted(corrected.scans, "scan")
            << " of drive '" << corrected.drive << "' moved, the farthest by "
            << numberText(std::round(1e3 * corrected.largest_move) / 1e3) << " m; "
            << counted(corrected.tiles, "tile") << " changed, in "
            << numberText(std::round(watch.lap() / 100.0) / 10.0) << " s\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "correct_map",
                    "correct_map FILE.bkm --poses FILE\n"
                    "Moves the scans of a map's journal to corrected poses. The map is then the one that "
                    "these poses would have made.",
                    options(), correctMap, "files");
}
