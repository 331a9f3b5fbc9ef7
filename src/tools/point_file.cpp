#include "tools/point_file.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iostream>
#include <sstream>
#include <stdexcept>

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

}  // namespace bki_mapping::tools
