#include "io/trajectory_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/io/sequence.h"

namespace bki_mapping {
namespace {

std::vector<Eigen::Vector3d> readPoses(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::invalid_argument("the trajectory " + path + " cannot be read");
  std::vector<Eigen::Vector3d> points;
  std::size_t number = 0;
  for (std::string line; std::getline(file, line);) {
    ++number;
    std::istringstream words(line);
    std::string first;
    if (!(words >> first) || first[0] == '#') continue;
    Eigen::Vector3d point;
    if (!(words >> point.x() >> point.y() >> point.z()) || !point.allFinite()) {
      throw std::invalid_argument(path + " line " + std::to_string(number) +
                                  " is not a pose; write: stamp x y z qx qy qz qw");
    }
    points.push_back(point);
  }
  if (points.empty()) throw std::invalid_argument("the trajectory " + path + " has no pose");
  return points;
}

}  // namespace

Trajectory readTrajectory(const std::string& path) {
  Trajectory trajectory;
  trajectory.name = std::filesystem::path(path).lexically_normal().filename().string();
  if (!std::filesystem::is_directory(path)) {
    trajectory.points = readPoses(path);
    return trajectory;
  }
  const Sequence sequence(path);
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    trajectory.points.push_back(sequence.pose(i).translation());
  }
  return trajectory;
}

}  // namespace bki_mapping
