// Asks a city, or a map file, and reads only the tiles that the answer needs.
#include <cmath>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/city/tiled_map.h"
#include "bki_mapping/core/named_parameter.h"
#include "core/atomic_file.h"
#include "core/counted.h"
#include "core/stopwatch.h"
#include "export/map_picture.h"
#include "export/map_statistics.h"
#include "tools/options.h"
#include "tools/point_query.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("point", po::value<std::vector<std::string>>()->value_name("\"X Y Z\"")->composing(),
                        "say what is at a point, map frame [m]; repeatable")(
      "points", tools::textOption("FILE.csv"),
      "the same for the points of a file with lines x,y,z; -: standard input")(
      "nearest", tools::realOption("--nearest", 0.0)->value_name("M"),
      "also say which obstacle is nearest to each point, up to this distance [m]")(
      "classes", tools::textOption("NAMES"),
      "only obstacles of these classes, joined by commas; default: all")(
      "output", tools::textOption("FILE.csv"),
      "write the answers for points there; default: standard output")(
      "box", tools::textOption("\"X0 Y0 Z0 X1 Y1 Z1\""),
      "count the voxels in a box: two opposite corners, in the map frame [m]; inf and -inf are allowed")(
      "section", po::value<double>()->value_name("Z"),
      "of the box, only the layer of voxels at this height [m]")(
      "top", tools::textOption("FILE.png"), "draw the box as seen from above; with --section, the section")(
      "cost", po::bool_switch(),
      "also say, on standard error, how many tiles and files were read, and how long all took");
  tools::addMemoryLimit(options);
  return options;
}

std::vector<Eigen::Vector3d> pointsOf(const po::variables_map& given) {
  std::vector<Eigen::Vector3d> points;
  if (given.count("point")) {
    for (const std::string& text : given["point"].as<std::vector<std::string>>()) {
      const auto point = tools::parsePoint(text);
      if (!point) throw std::invalid_argument("--point " + text + " is not three finite numbers");
      points.push_back(*point);
    }
  }
  if (given.count("points")) tools::readPointFile(given["points"].as<std::string>(), points);
  return points;
}

ClassFilter filterOf(const po::variables_map& given, const ClassTable& table) {
  if (!given.count("classes")) return ClassFilter::all();
  std::vector<std::string> names;
  std::istringstream list(given["classes"].as<std::string>());
  for (std::string name; std::getline(list, name, ',');) names.push_back(name);
  return ClassFilter::of(table, names);
}

void askPoints(TiledMap& map, const po::variables_map& given) {
  const std::vector<Eigen::Vector3d> points = pointsOf(given);
  const std::string output = given.count("output") ? given["output"].as<std::string>() : "";
  if (!output.empty()) checkWritable(output);
  tools::PointQuery query(map, points, tools::memoryLimit(given));
  query.readAll();
  const bool with_nearest = given.count("nearest") > 0;
  const ClassTable& classes = *map.info().classes;
  if (with_nearest) query.findNearest(given["nearest"].as<double>(), filterOf(given, classes));
  std::ostringstream text;
  query.print(text, classes, with_nearest);
  if (output.empty()) {
    std::cout << text.str();
  } else {
    writeTextFile(output, text.str());
  }
}

void printBounds(const char* what, const Eigen::AlignedBox3d& box) {
  std::cout << what;
  for (const Eigen::Index axis : {0, 1, 2}) {
    std::cout << (axis == 0 ? " " : ", ") << "xyz"[axis] << " from " << box.min()[axis] << " to "
              << box.max()[axis];
  }
  std::cout << " m\n";
}

void askBox(TiledMap& map, const po::variables_map& given) {
  Eigen::AlignedBox3d box = tools::parseBox(given["box"].as<std::string>());
  if (given.count("section")) {
    const double z = given["section"].as<double>();
    const GridGeometry grid(map.resolution());
    if (!grid.contains({0.0, 0.0, z})) throw std::invalid_argument("--section is beyond the grid of the map");
    box.min().z() = box.max().z() = grid.voxelCentre(grid.voxelAt({0.0, 0.0, z})).z();
  }
  const std::string picture = given.count("top") ? given["top"].as<std::string>() : "";
  if (!picture.empty()) checkWritable(picture);
  const RuledMap stored = map.readBox(box, tools::memoryLimit(given));
  const MapStatistics found = statisticsOf(stored.map, stored.rules);
  const double volume = std::pow(stored.info.resolution, 3.0);
  std::cout << std::fixed << std::setprecision(1);
  const Eigen::AlignedBox3d bounds = found.bounds(stored.info.resolution);
  if (!bounds.isEmpty()) printBounds("known:", bounds);
  for (const auto& [name, count] :
       {std::make_pair("occupied", found.occupied), {"free", found.free}, {"occluded", found.occluded}}) {
    std::cout << name << ": " << counted(count, "voxel") << ", " << volume * static_cast<double>(count)
              << " m3\n";
  }
  for (const auto& [id, count] : found.occupied_by_class) {
    std::cout << "  " << stored.info.classes->nameOf(id) << ": " << count << "\n";
  }
  if (picture.empty()) return;
  MapPicture drawing(MapPicture::View::kTop, found.low, found.high);
  statisticsOf(stored.map, stored.rules,
               [&](const BlockIndex& index, const BlockView& view) { drawing.add(index, view); });
  writePng(picture, drawing.draw(*stored.info.classes));
  std::cout << picture << ": " << numberText(stored.info.resolution * drawing.voxelsPerPixel())
            << " m a pixel\n";
}

void describe(TiledMap& map) {
  std::uint64_t bytes = 0;
  Eigen::AlignedBox3d bounds;
  for (const CityRegion& region : map.regions()) {
    bytes += region.bytes;
    bounds.extend(region.bounds);
  }
  if (MapFile* const file = map.file()) bytes = file->size().bytes;
  const MapInfo& info = map.info();
  std::cout << map.path() << ": " << counted(map.tileCount(), "tile") << " in "
            << counted(map.fileCount(), "file") << ", " << std::fixed << std::setprecision(1)
            << static_cast<double>(bytes) / 1e6 << " MB\n"
            << "frame " << info.frame << ", resolution " << numberText(info.resolution) << " m, class table "
            << info.classes->name() << "\n";
  if (!bounds.isEmpty()) printBounds("known:", bounds);
  if (map.isCity()) std::cout << "drives:\n";
  for (const std::string& name : map.driveNames()) std::cout << "  " << name << "\n";
}

void checkOptions(const po::variables_map& given, bool points) {
  const auto needs = [&](const char* option, bool there, const std::string& other) {
    if (given.count(option) && !there)
      throw std::invalid_argument("--" + std::string(option) + " needs " + other);
  };
  for (const char* option : {"nearest", "output"}) needs(option, points, "--point or --points");
  for (const char* option : {"section", "top"}) needs(option, given.count("box") > 0, "--box");
  needs("classes", given.count("nearest") > 0, "--nearest");
  if (points && given.count("box")) {
    throw std::invalid_argument(
        "--box and --point or --points are questions of their own; ask one at a time");
  }
  const std::string picture = given.count("top") ? given["top"].as<std::string>() : ".png";
  if (picture.size() < 4 || picture.compare(picture.size() - 4, 4, ".png") != 0) {
    throw std::invalid_argument("--top " + picture + " must end in .png");
  }
}

int query(const po::variables_map& given) {
  Stopwatch watch;
  const bool points = given.count("point") > 0 || given.count("points") > 0;
  checkOptions(given, points);
  TiledMap map(tools::onlyMapFile(given));
  if (points) {
    askPoints(map, given);
  } else if (given.count("box")) {
    askBox(map, given);
  } else {
    describe(map);
  }
  if (!given["cost"].as<bool>()) return 0;
  const TiledMap::Reading reading = map.reading();
  std::cerr << "read " << reading.tiles << " of " << counted(map.tileCount(), "tile") << ", in "
            << reading.files << " of " << counted(map.fileCount(), "file") << "; " << std::fixed
            << std::setprecision(1) << watch.lap() << " ms\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "query_city",
                    "query_city MAP [--point \"X Y Z\"]... [--box \"X0 Y0 Z0 X1 Y1 Z1\"]\n"
                    "Asks a city (the folder that map_city wrote) or a map file (.bkm), and reads "
                    "only the tiles that the answer needs. Without a question, it describes the map.",
                    options(), query, "files");
}
