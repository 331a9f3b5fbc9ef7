#include "sequence/trajectory_file.h"

#include <filesystem>
#include <stdexcept>

#include "sequence/pose_file.h"

namespace bki_mapping {
namespace {

std::vector<Eigen::Vector3d> readPositions(const std::string& path) {
  constexpr char kRemedy[] = "give a file of poses, or the folder of a sequence";
  std::vector<Eigen::Vector3d> points;
  for (const PoseLine& line : readPoseFile(path, kRemedy).lines) {
    if (line.blank) continue;
    if (!line.fault.empty()) throw std::runtime_error(line.fault);
    points.push_back(line.pose.translation());
  }
  if (points.empty()) throw std::runtime_error("the trajectory " + path + " has no pose");
  return points;
}

}  // namespace

LidarPoses readLidarPoses(const std::string& path, const std::string& calibration,
                          std::optional<PosesIn> poses_in) {
  const PoseFile file = readPoseFile(path, "give a file of poses");
  if (file.lines.empty()) throw std::runtime_error("the trajectory " + path + " has no pose");
  LidarPoses lidar;
  if (poses_in.value_or(file.has_stamps ? PosesIn::kLidar : PosesIn::kCamera) == PosesIn::kCamera)
    lidar.T_camera_sensor = readCalibration(calibration);
  for (const PoseLine& line : file.lines) {
    if (line.blank)
      throw std::runtime_error(path + " line " + std::to_string(line.number) + " has no pose; write one");
    for (const std::string& fault : {line.fault, line.rotation_fault}) {
      if (!fault.empty()) throw std::runtime_error(fault);
    }
    lidar.poses.push_back(lidar.T_camera_sensor.inverse() * line.pose * lidar.T_camera_sensor);
    if (line.seconds) lidar.seconds.push_back(*line.seconds);
  }
  return lidar;
}

Trajectory readTrajectory(const std::string& path) {
  Trajectory trajectory;
  trajectory.name = std::filesystem::path(path).lexically_normal().filename().string();
  if (!std::filesystem::is_directory(path)) {
    trajectory.points = readPositions(path);
    return trajectory;
  }
  SequenceOptions options;
  options.labels.clear();  // only the poses matter
  const Sequence sequence(path, options);
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    trajectory.points.push_back(sequence.pose(i).translation());
  }
  return trajectory;
}

}  // namespace bki_mapping
