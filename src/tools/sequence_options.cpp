#include "tools/sequence_options.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <optional>
#include <stdexcept>

#include "sequence/pose_agreement.h"

namespace bki_mapping::tools {
namespace {

/// Whether a class table gives every hit the same class, whatever its label.
bool hasOneClass(const ClassTable& table) {
  return table.classes().size() == 1 && table.classes().front().any_raw;
}

}  // namespace

std::optional<PosesIn> posesIn(const po::variables_map& given) {
  if (!given.count("poses-in")) return std::nullopt;
  const std::string sensor = given["poses-in"].as<std::string>();
  if (sensor == "camera") return PosesIn::kCamera;
  if (sensor == "lidar") return PosesIn::kLidar;
  throw std::invalid_argument("--poses-in '" + sensor + "' is unknown; known sensors: camera, lidar");
}

po::options_description sequenceOptions() {
  po::options_description options("Sequence");
  options.add_options()("sequence", po::value<std::string>()->value_name("DIR"),
                        "folder with velodyne/, labels/, poses.txt, calib.txt")(
      "labels", po::value<std::string>()->value_name("FOLDER|none")->default_value("labels"),
      "name of the folder with the labels; none: the scans have no labels, and all are 0")(
      "poses-in", po::value<std::string>()->value_name("camera|lidar"),
      "which sensor the poses are of; default: the camera, as in KITTI, and the lidar if poses have stamps")(
      "first", countOption("--first", 0)->value_name("N")->default_value(0),
      "number of the first scan, as in its file name")("scans", countOption("--scans", 1)->value_name("N"),
                                                       "number of scans; default: all");
  return options;
}

SequenceOptions sequenceOptionsOf(const po::variables_map& given) {
  if (!given.count("sequence")) throw std::invalid_argument("--sequence DIR is missing (see --help)");
  SequenceOptions options;
  options.labels = given["labels"].as<std::string>();
  const bool missing = !std::filesystem::is_directory(
      std::filesystem::path(given["sequence"].as<std::string>()) / options.labels);
  const bool needless =
      given["labels"].defaulted() && missing && given.count("classes") && hasOneClass(*classTable(given));
  if (options.labels == "none" || needless) options.labels.clear();
  if (given.count("poses")) options.map_poses = given["poses"].as<std::string>();
  options.poses_in = posesIn(given);
  return options;
}

Sequence openSequence(const po::variables_map& given) {
  const SequenceOptions options = sequenceOptionsOf(given);
  Sequence sequence(given["sequence"].as<std::string>(), options);
  const std::string gaps = sequence.gaps();
  if (!gaps.empty()) std::cerr << gaps << "; the others keep their poses and times\n";
  return sequence;
}

std::pair<std::size_t, std::size_t> frameRange(const po::variables_map& given, const Sequence& sequence) {
  const std::size_t number = count(given, "first"), end = sequence.size() - 1;
  if (number > sequence.number(end)) {
    throw std::invalid_argument("--first " + std::to_string(number) + " is beyond the last scan, " +
                                sequence.name(end));
  }
  std::size_t first = 0;
  while (sequence.number(first) < number) ++first;
  std::size_t scans = sequence.size() - first;
  if (given.count("scans")) scans = std::min(scans, count(given, "scans"));
  for (std::size_t i = first; i < first + scans; ++i) sequence.pose(i);
  return {first, first + scans};
}

void warnOfPoses(const po::variables_map& given, std::size_t first, std::size_t last) {
  warn(poseWarning(given["sequence"].as<std::string>(), sequenceOptionsOf(given), first, last));
}

}  // namespace bki_mapping::tools
