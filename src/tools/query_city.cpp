// Asks a city, or a map file, and reads only the tiles that the answer needs.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/io/tiled_map.h"
#include "bki_mapping/query/queries.h"
#include "core/atomic_file.h"
#include "core/stopwatch.h"
#include "io/map_picture.h"
#include "io/map_statistics.h"
#include "map/neighbourhood.h"
#include "store/box_tiles.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

constexpr std::size_t kMostPoints = 10'000'000;
/// Tiles that are in memory at once for points. (For nearest obstacles, those about one tile are.)
constexpr std::size_t kTilesAtOnce = 64;
/// Where the search for the nearest obstacle begins [m].
constexpr double kFirstReach = 5.0;

po::options_description options() {
  po::options_description options("Options");
  const auto text = [](const char* name) { return po::value<std::string>()->value_name(name); };
  options.add_options()("point", po::value<std::vector<std::string>>()->value_name("\"X Y Z\"")->composing(),
                        "say what is at a point, map frame [m]; repeatable")(
      "points", text("FILE.csv"), "the same for the points of a file with lines x,y,z; -: standard input")(
      "nearest", tools::realOption("--nearest", 0.0)->value_name("M"),
      "also say which obstacle is nearest to each point, up to this distance [m]")(
      "classes", text("NAMES"), "only obstacles of these classes, joined by commas; default: all")(
      "output", text("FILE.csv"), "write the answers for points there; default: standard output")(
      "box", text("\"X0 Y0 Z0 X1 Y1 Z1\""),
      "count the voxels in a box: two opposite corners, in the map frame [m]; inf and -inf are allowed")(
      "section", po::value<double>()->value_name("Z"),
      "of the box, only the layer of voxels at this height [m]")(
      "top", text("FILE.png"), "draw the box as seen from above; with --section, the section");
  tools::addMemoryLimit(options);
  return options;
}

std::string coordinates(const Eigen::Vector3d& point) {
  return numberText(point.x()) + "," + numberText(point.y()) + "," + numberText(point.z());
}

/// Three numbers, separated by commas or spaces. @return nothing if the text is anything else.
std::optional<Eigen::Vector3d> parsePoint(std::string text) {
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream words(text);
  Eigen::Vector3d point;
  std::string rest;
  if (!(words >> point.x() >> point.y() >> point.z()) || words >> rest || !point.allFinite())
    return std::nullopt;
  return point;
}

void readPointsOf(std::istream& in, const std::string& name, std::vector<Eigen::Vector3d>& points) {
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (line.find_first_not_of(" \t\r,") == std::string::npos || line[0] == '#') continue;
    const auto point = parsePoint(line.substr(0, line.find_last_not_of("\r") + 1));
    if (!point && number == 1 && std::isalpha(static_cast<unsigned char>(line[0]))) continue;  // the header
    if (!point) {
      throw std::invalid_argument(name + ", line " + std::to_string(number) +
                                  ": not three finite numbers x,y,z");
    }
    if (points.size() == kMostPoints) {
      throw std::invalid_argument(name + " has more than " + std::to_string(kMostPoints) +
                                  " points; split the file");
    }
    points.push_back(*point);
  }
}

std::vector<Eigen::Vector3d> pointsOf(const po::variables_map& given) {
  std::vector<Eigen::Vector3d> points;
  if (given.count("point")) {
    for (const std::string& text : given["point"].as<std::vector<std::string>>()) {
      const auto point = parsePoint(text);
      if (!point) throw std::invalid_argument("--point " + text + " is not three finite numbers");
      points.push_back(*point);
    }
  }
  if (given.count("points")) {
    const std::string path = given["points"].as<std::string>();
    if (path == "-") {
      readPointsOf(std::cin, "standard input", points);
    } else {
      std::ifstream file(path);
      if (!file) throw std::invalid_argument(path + " cannot be read; check name and rights");
      readPointsOf(file, path, points);
    }
  }
  return points;
}

ClassFilter filterOf(const po::variables_map& given, const ClassTable& table) {
  if (!given.count("classes")) return ClassFilter::all();
  std::vector<std::string> names;
  std::istringstream list(given["classes"].as<std::string>());
  for (std::string name; std::getline(list, name, ',');) names.push_back(name);
  return ClassFilter::of(table, names);
}

std::string nameOf(const ClassTable& classes, ClassId id) {
  const SemanticClass* const known = classes.find(id);
  return known ? known->name : "";
}

/// The answers for one point.
struct Answer {
  VoxelState state = VoxelState::kUnknown;
  ClassId label = kFreeClass;
  float occupancy = 0.0f, class_probability = 0.0f, probability = 0.0f, variance = 0.0f;
  std::optional<NearestObstacle> nearest;
};

/// Points, sorted by the tile that holds them, so that tiles are read once.
class PointQuery {
 public:
  PointQuery(TiledMap& map, const std::vector<Eigen::Vector3d>& points, std::size_t memory_limit)
      : map_(map), grid_(map.resolution()), points_(points), answers_(points.size()), limit_(memory_limit) {
    for (std::size_t n = 0; n < points.size(); ++n) {
      sorted_.emplace_back(grid_.contains(points[n]) ? tileOf(grid_.voxelAt(points[n])) : kNoTile, n);
    }
    std::sort(sorted_.begin(), sorted_.end());
  }

  void readAll() {
    forEachGroup(kTilesAtOnce, [&](const std::vector<std::size_t>& numbers) {
      std::vector<Eigen::Vector3d> at;
      for (const std::size_t n : numbers) at.push_back(points_[n]);
      const StoredMap stored = map_.readTilesAt(at, limit_);
      const StateMap states(stored.map);
      std::vector<VoxelState> state(at.size());
      std::vector<ClassId> label(at.size());
      std::vector<float> occupancy(at.size()), of_class(at.size()), probability(at.size()),
          variance(at.size());
      readPoints(states, Span<const Eigen::Vector3d>(at.data(), at.size()),
                 {state.data(), label.data(), occupancy.data(), of_class.data(), probability.data(),
                  variance.data()});
      for (std::size_t i = 0; i < numbers.size(); ++i) {
        answers_[numbers[i]] = {state[i],    label[i], occupancy[i], of_class[i], probability[i],
                                variance[i], {}};
      }
    });
  }

  /// Widens the box about the points of a tile until an obstacle is found, or the distance is reached.
  void findNearest(double most, const ClassFilter& classes) {
    forEachGroup(1, [&](std::vector<std::size_t> waiting) {
      if (!grid_.contains(points_[waiting[0]])) return;
      for (double reach = std::min(kFirstReach, most); !waiting.empty();
           reach = std::min(2.0 * reach, most)) {
        Eigen::AlignedBox3d box;
        for (const std::size_t n : waiting) box.extend(points_[n]);
        const Eigen::Vector3d margin =
            Eigen::Vector3d::Constant(reach + (1.0 + kNeighbourhoodReach) * grid_.resolution());
        const StoredMap stored = map_.readBox({box.min() - margin, box.max() + margin}, limit_);
        const StateMap states(stored.map);
        std::vector<std::size_t> left;
        for (const std::size_t n : waiting) {
          answers_[n].nearest = nearestObstacle(states, points_[n], classes, reach);
          if (!answers_[n].nearest) left.push_back(n);
        }
        if (reach >= most) break;
        waiting = std::move(left);
      }
    });
  }

  void print(std::ostream& out, const ClassTable& classes, bool with_nearest) const {
    constexpr const char* kStates[] = {"unknown", "free", "occupied", "occluded"};
    out << "x,y,z,state,class,occupancy,class_probability,probability,variance"
        << (with_nearest ? ",nearest_distance,nearest_class,nearest_x,nearest_y,nearest_z" : "") << "\n";
    for (std::size_t n = 0; n < points_.size(); ++n) {
      const Answer& a = answers_[n];
      out << coordinates(points_[n]) << "," << kStates[static_cast<std::size_t>(a.state)] << ","
          << nameOf(classes, a.label) << "," << a.occupancy << "," << a.class_probability << ","
          << a.probability << "," << a.variance;
      if (with_nearest && a.nearest) {
        out << "," << a.nearest->distance << "," << nameOf(classes, a.nearest->label) << ","
            << coordinates(grid_.voxelCentre(a.nearest->voxel));
      } else if (with_nearest) {
        out << ",,,,,";
      }
      out << "\n";
    }
  }

 private:
  /// Calls visit(numbers) for the points of each few tiles.
  template <typename Visit>
  void forEachGroup(std::size_t tiles, Visit&& visit) {
    std::vector<std::size_t> numbers;
    std::size_t in_group = 0;
    for (std::size_t i = 0; i < sorted_.size(); ++i) {
      if (i == 0 || sorted_[i].first != sorted_[i - 1].first) {
        if (in_group == tiles) {
          visit(numbers);
          numbers.clear();
          in_group = 0;
        }
        ++in_group;
      }
      numbers.push_back(sorted_[i].second);
    }
    if (!numbers.empty()) visit(numbers);
  }

  /// Stands for the tiles of points beyond the grid.
  static constexpr GridIndex kNoTile{std::numeric_limits<std::int32_t>::max(), 0, 0};

  TiledMap& map_;
  GridGeometry grid_;
  const std::vector<Eigen::Vector3d>& points_;
  std::vector<Answer> answers_;
  std::vector<std::pair<GridIndex, std::size_t>> sorted_;
  std::size_t limit_;
};

void askPoints(TiledMap& map, const po::variables_map& given) {
  const std::vector<Eigen::Vector3d> points = pointsOf(given);
  const std::string output = given.count("output") ? given["output"].as<std::string>() : "";
  if (!output.empty()) checkWritable(output);
  PointQuery query(map, points, tools::memoryLimit(given));
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
  const StoredMap stored = map.readBox(box, tools::memoryLimit(given));
  const MapStatistics found = statisticsOf(stored.map);
  const double volume = std::pow(stored.info.resolution, 3.0);
  std::cout << std::fixed << std::setprecision(1);
  const Eigen::AlignedBox3d bounds = found.bounds(stored.info.resolution);
  if (!bounds.isEmpty()) printBounds("known:", bounds);
  for (const auto& [name, count] :
       {std::make_pair("occupied", found.occupied), {"free", found.free}, {"occluded", found.occluded}}) {
    std::cout << name << ": " << count << " voxels, " << volume * static_cast<double>(count) << " m3\n";
  }
  for (const auto& [id, count] : found.occupied_by_class) {
    std::cout << "  " << nameOf(*stored.info.classes, id) << ": " << count << "\n";
  }
  if (picture.empty()) return;
  MapPicture drawing(MapPicture::View::kTop, found.low, found.high);
  statisticsOf(stored.map, [&](const BlockIndex& index, const BlockView& view) { drawing.add(index, view); });
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
  std::cout << map.path() << ": " << map.tileCount() << " tiles in " << map.fileCount() << " files, "
            << std::fixed << std::setprecision(1) << static_cast<double>(bytes) / 1e6 << " MB\n"
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
  const TiledMap::Reading reading = map.reading();
  std::cerr << "read " << reading.tiles << " of " << map.tileCount() << " tiles, in " << reading.files
            << " of " << map.fileCount() << " files; " << std::fixed << std::setprecision(1) << watch.lap()
            << " ms\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run("query_city", [&] {
    const auto given =
        tools::parse(argc, argv,
                     "query_city MAP [--point \"X Y Z\"]... [--box \"X0 Y0 Z0 X1 Y1 Z1\"]\n"
                     "Asks a city (the folder that map_city wrote) or a map file (.bkm), and reads "
                     "only the tiles that the answer needs. Without a question, it describes the map.",
                     options(), "files");
    return given ? query(*given) : 0;
  });
}
