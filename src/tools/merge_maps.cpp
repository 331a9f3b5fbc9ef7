// Merges map files: each drive counts once, whatever the order of the files.
#include <algorithm>
#include <array>
#include <charconv>
#include <iostream>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/store/map_merge.h"
#include "bki_mapping/store/mapper_file.h"
#include "core/counted.h"
#include "tools/interruption.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

using Words = std::vector<std::string>;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("output", po::value<std::string>()->value_name("FILE.bkm"),
                        "the merged map; may be one of the inputs")(
      "keep-drives", po::bool_switch(), "also store each drive separately, so that it can be taken out")(
      "without", po::value<Words>()->value_name("DRIVE")->composing(),
      "leave a drive out, by its id; repeatable")(
      "allow-overlap", po::bool_switch(),
      "also add drives that share scans by their ids, which count twice then")(
      "tiles", po::value<std::string>()->value_name("X0,Y0,X1,Y1"),
      "write only the tiles whose indices x and y are between these, which are included; a tile is a cube of "
      "64 voxels")(
      "transform", po::value<Words>()->value_name("FILE=X,Y,Z,YAW")->composing(),
      "turn the map in FILE about the z axis by YAW degrees, then move it by X, Y, Z metres; repeatable. "
      "Whole voxels and multiples of 90 degrees are exact, others approximate");
  return options;
}

/// @param text as in --tiles.
TileColumns parseColumns(const std::string& text) {
  std::array<std::int32_t, 4> numbers{};
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t n = 0; n < numbers.size(); ++n) {
    const auto [next, fault] = std::from_chars(at, end, numbers[n]);
    const bool last = n + 1 == numbers.size();
    if (fault != std::errc() || (last ? next != end : next == end || *next != ',')) {
      throw std::invalid_argument("--tiles " + text +
                                  " is not of the form X0,Y0,X1,Y1 with four whole numbers");
    }
    at = next + 1;
  }
  const TileColumns columns{numbers[0], numbers[1], numbers[2], numbers[3]};
  if (columns.low_x > columns.high_x || columns.low_y > columns.high_y) {
    throw std::invalid_argument("--tiles " + text + " has a first index above the last; exchange them");
  }
  return columns;
}

/// @param text as in --transform.
std::pair<std::string, MapPlacement> parsePlacement(const std::string& text) {
  const auto fail = [&]() -> std::invalid_argument {
    return std::invalid_argument(
        "--transform " + text +
        " is not of the form FILE=X,Y,Z,YAW with three lengths [m] and an angle [degrees]");
  };
  const std::size_t equals = text.rfind('=');
  if (equals == std::string::npos) throw fail();
  std::vector<double> numbers;
  std::string rest = text.substr(equals + 1) + ",";
  for (std::size_t comma; (comma = rest.find(',')) != std::string::npos; rest.erase(0, comma + 1)) {
    std::size_t end = 0;
    try {
      numbers.push_back(std::stod(rest, &end));
    } catch (const std::logic_error&) {
      throw fail();
    }
    if (end != comma) throw fail();
  }
  if (numbers.size() != 4) throw fail();
  return {text.substr(0, equals), {{numbers[0], numbers[1], numbers[2]}, numbers[3]}};
}

Words words(const po::variables_map& given, const char* name) {
  return given.count(name) ? given[name].as<Words>() : Words();
}

MergeOptions mergeOptions(const po::variables_map& given) {
  MergeOptions options;
  for (const std::string& path : words(given, "inputs")) options.inputs.push_back({path, std::nullopt});
  if (options.inputs.empty()) throw std::invalid_argument("the names of the maps are missing (see --help)");
  if (!given.count("output")) throw std::invalid_argument("--output FILE.bkm is missing (see --help)");
  options.output = given["output"].as<std::string>();
  if (!isMapFileName(options.output)) {
    throw std::invalid_argument("--output " + options.output + " must end in .bkm");
  }
  options.keep_drives = given["keep-drives"].as<bool>();
  options.without = words(given, "without");
  options.allow_overlap = given["allow-overlap"].as<bool>();
  if (given.count("tiles")) options.columns = parseColumns(given["tiles"].as<std::string>());
  for (const std::string& text : words(given, "transform")) {
    const auto [path, placement] = parsePlacement(text);
    bool found = false;
    for (MergeInput& input : options.inputs) {
      if (input.path != path) continue;
      if (input.placement)
        throw std::invalid_argument("--transform is given twice for " + path + "; keep one");
      input.placement = placement;
      found = true;
    }
    if (!found) throw std::invalid_argument("--transform names " + path + ", which is none of the maps");
  }
  return options;
}

int mergeFiles(const po::variables_map& given) {
  MergeOptions options = mergeOptions(given);
  const tools::Interruption interruption;
  options.progress = [&](std::size_t done, std::size_t all) {
    tools::showProgress(done, all, "tiles");
    if (done == all || !interruption.requested()) return;
    // A map of some tiles would look like the whole one.
    throw tools::Stopped("stopped after " + std::to_string(done) + " of " + counted(all, "tile") + "; " +
                         options.output + " is as it was");
  };
  const MergeReport report = mergeMaps(options);
  for (const std::string& sentence : report.without_journal) tools::warn(sentence);
  for (const std::string& path : report.resampled) {
    std::cerr << "warning: " << path
              << " is not turned by a multiple of 90 degrees and moved by whole voxels; each voxel takes the "
                 "evidence of the nearest one, which is approximate\n";
  }
  if (report.saturated > 0) {
    std::cerr << "warning: " << counted(report.saturated, "sum") << " of evidence saturated at 32,768\n";
  }
  std::cout << options.output << ": " << counted(report.drives.size(), "drive") << ", "
            << counted(report.blocks, "block") << " in " << counted(report.tiles, "tile") << "\n";
  for (const std::string& id : report.repeated) {
    std::cout << "drive '" << id << "' is in more than one map, and counts once\n";
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "merge_maps",
                    "merge_maps FILE.bkm... --output FILE.bkm\n"
                    "Merges maps: the result holds each of their drives once.",
                    options(), mergeFiles, "inputs");
}
