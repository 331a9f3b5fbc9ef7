#include "tools/point_query.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iostream>
#include <ostream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "bki_mapping/core/named_parameter.h"
#include "rules/neighbourhood.h"
#include "store/box_tiles.h"

namespace bki_mapping::tools {
namespace {

constexpr std::size_t kMostPoints = 10'000'000;

/// @param name of the text, for errors.
void parsePoints(std::istream& in, const std::string& name, std::vector<Eigen::Vector3d>& points) {
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

/// Tiles that are in memory at once for points. (For nearest obstacles, those about one tile are.)
constexpr std::size_t kTilesAtOnce = 64;
/// Where the search for the nearest obstacle begins [m].
constexpr double kFirstReach = 5.0;

std::string coordinates(const Eigen::Vector3d& point) {
  return numberText(point.x()) + "," + numberText(point.y()) + "," + numberText(point.z());
}

}  // namespace

std::optional<Eigen::Vector3d> parsePoint(std::string text) {
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream words(text);
  Eigen::Vector3d point;
  std::string rest;
  if (!(words >> point.x() >> point.y() >> point.z()) || words >> rest || !point.allFinite())
    return std::nullopt;
  return point;
}

void readPointFile(const std::string& path, std::vector<Eigen::Vector3d>& points) {
  if (path == "-") {
    parsePoints(std::cin, "standard input", points);
    return;
  }
  std::ifstream file(path);
  if (!file) throw std::invalid_argument(path + " cannot be read; check name and rights");
  parsePoints(file, path, points);
}

template <typename Visit>
void PointQuery::forEachGroup(std::size_t tiles, Visit&& visit) {
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

PointQuery::PointQuery(TiledMap& map, const std::vector<Eigen::Vector3d>& points, std::size_t memory_limit)
    : map_(map), grid_(map.resolution()), points_(points), answers_(points.size()), limit_(memory_limit) {
  for (std::size_t n = 0; n < points.size(); ++n) {
    sorted_.emplace_back(grid_.contains(points[n]) ? tileOf(grid_.voxelAt(points[n])) : kNoTile, n);
  }
  std::sort(sorted_.begin(), sorted_.end());
}

void PointQuery::readAll() {
  forEachGroup(kTilesAtOnce, [&](const std::vector<std::size_t>& numbers) {
    std::vector<Eigen::Vector3d> at;
    for (const std::size_t n : numbers) at.push_back(points_[n]);
    const RuledMap stored = map_.readTilesAt(at, limit_);
    const StateMap states(stored.map, stored.rules);
    std::vector<VoxelState> state(at.size());
    std::vector<ClassId> label(at.size());
    std::vector<float> occupancy(at.size()), of_class(at.size()), probability(at.size()), variance(at.size());
    readPoints(
        states, Span<const Eigen::Vector3d>(at.data(), at.size()),
        {state.data(), label.data(), occupancy.data(), of_class.data(), probability.data(), variance.data()});
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      answers_[numbers[i]] = {state[i], label[i], occupancy[i], of_class[i], probability[i], variance[i], {}};
    }
  });
}

// Widens the box about the points of a tile until an obstacle is found, or the distance is reached.
void PointQuery::findNearest(double most, const ClassFilter& classes) {
  forEachGroup(1, [&](std::vector<std::size_t> waiting) {
    if (!grid_.contains(points_[waiting[0]])) return;
    for (double reach = std::min(kFirstReach, most); !waiting.empty(); reach = std::min(2.0 * reach, most)) {
      Eigen::AlignedBox3d box;
      for (const std::size_t n : waiting) box.extend(points_[n]);
      const Eigen::Vector3d margin =
          Eigen::Vector3d::Constant(reach + (1.0 + StateRules::kMostReach) * grid_.resolution());
      const RuledMap stored = map_.readBox({box.min() - margin, box.max() + margin}, limit_);
      const StateMap states(stored.map, stored.rules);
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

void PointQuery::print(std::ostream& out, const ClassTable& classes, bool with_nearest) const {
  constexpr const char* kStates[] = {"unknown", "free", "occupied", "occluded"};
  out << "x,y,z,state,class,occupancy,class_probability,probability,variance"
      << (with_nearest ? ",nearest_distance,nearest_class,nearest_x,nearest_y,nearest_z" : "") << "\n";
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Answer& a = answers_[n];
    out << coordinates(points_[n]) << "," << kStates[static_cast<std::size_t>(a.state)] << ","
        << classes.nameOf(a.label) << "," << a.occupancy << "," << a.class_probability << "," << a.probability
        << "," << a.variance;
    if (with_nearest && a.nearest) {
      out << "," << a.nearest->distance << "," << classes.nameOf(a.nearest->label) << ","
          << coordinates(grid_.voxelCentre(a.nearest->voxel));
    } else if (with_nearest) {
      out << ",,,,,";
    }
    out << "\n";
  }
}

}  // namespace bki_mapping::tools
