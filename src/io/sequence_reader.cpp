#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/io/sequence.h"

namespace bki_mapping {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const std::string& text) {
  throw std::runtime_error(text);
}

std::ifstream openFile(const fs::path& path, const std::string& remedy) {
  std::ifstream file(path, std::ios::binary);
  if (!file || fs::is_directory(path)) fail(path.string() + " cannot be read; " + remedy);
  return file;
}

/// The numbers of each line that is not empty.
std::vector<std::vector<double>> readNumberLines(const fs::path& path, const std::string& remedy) {
  std::ifstream file = openFile(path, remedy);
  std::vector<std::vector<double>> lines;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::vector<double> numbers;
    for (std::string word; words >> word;) {
      char* end = nullptr;
      numbers.push_back(std::strtod(word.c_str(), &end));
      if (*end != '\0' || !std::isfinite(numbers.back())) {
        fail(path.string() + " line " + std::to_string(lines.size() + 1) + ": '" + word +
             "' is no finite number");
      }
    }
    if (!numbers.empty()) lines.push_back(numbers);
  }
  return lines;
}

/// A rigid transform from 3x4 row-major numbers; the rotation is made orthonormal.
Eigen::Isometry3d rigid(const std::vector<double>& numbers, const std::string& what) {
  if (numbers.size() != 12)
    fail(what + " has " + std::to_string(numbers.size()) + " numbers, but needs 12 (3x4)");
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(numbers.data());
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  if (!(std::abs(rotation.determinant() - 1.0) < 0.1)) {
    fail(what + " is no rigid transform: its rotation has determinant " +
         std::to_string(rotation.determinant()) + " instead of 1");
  }
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  T.translation() = matrix.col(3);
  return T;
}

Eigen::Isometry3d readCalibration(const fs::path& path) {
  std::ifstream file = openFile(path, "a sequence needs calib.txt with a line 'Tr:' (sensor to camera)");
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key != "Tr:" && key != "Tr") continue;
    std::vector<double> numbers;
    for (double number = 0.0; words >> number;) numbers.push_back(number);
    return rigid(numbers, path.string() + ", Tr:");
  }
  fail(path.string() + " has no line 'Tr:'; add the transform from sensor to camera");
}

template <typename T>
std::vector<T> readBinary(const fs::path& path, std::size_t record) {
  std::ifstream file = openFile(path, "check the sequence's folder");
  const auto bytes = static_cast<std::size_t>(fs::file_size(path));
  if (bytes % record != 0) {
    fail(path.string() + " has " + std::to_string(bytes) + " bytes, no multiple of " +
         std::to_string(record) + "; it is truncated or of another format");
  }
  std::vector<T> values(bytes / sizeof(T));
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(bytes));
  if (!file) fail(path.string() + " cannot be read to its end");
  return values;
}

std::vector<std::string> scanNames(const fs::path& folder) {
  if (!fs::is_directory(folder)) {
    fail(folder.string() + " is no folder; give the folder of a sequence, with velodyne/ inside");
  }
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".bin") names.push_back(entry.path().stem().string());
  }
  if (names.empty()) fail(folder.string() + " holds no scans (*.bin)");
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace

Sequence::Sequence(const std::string& folder, const std::string& labels)
    : folder_(folder), labels_(labels), names_(scanNames(fs::path(folder) / "velodyne")) {
  const fs::path root(folder);
  const Eigen::Isometry3d T_camera_sensor = readCalibration(root / "calib.txt");
  const auto poses = readNumberLines(root / "poses.txt", "a sequence needs a pose a scan");
  if (poses.size() < names_.size()) {
    fail((root / "poses.txt").string() + " has " + std::to_string(poses.size()) + " poses for " +
         std::to_string(names_.size()) + " scans; scan " + names_[poses.size()] + " has none");
  }
  Eigen::Isometry3d T_first = Eigen::Isometry3d::Identity();
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const std::string what = (root / "poses.txt").string() + " line " + std::to_string(i + 1);
    const Eigen::Isometry3d T = T_camera_sensor.inverse() * rigid(poses[i], what) * T_camera_sensor;
    if (i == 0) T_first = T;
    poses_.push_back(T_first.inverse() * T);
  }
  std::vector<std::vector<double>> times;
  if (fs::exists(root / "times.txt")) {
    times = readNumberLines(root / "times.txt", "check its rights");
    if (times.size() < names_.size()) {
      fail((root / "times.txt").string() + " has " + std::to_string(times.size()) + " times for " +
           std::to_string(names_.size()) + " scans");
    }
  }
  for (std::size_t i = 0; i < names_.size(); ++i) {
    const double seconds = times.empty() ? 0.1 * static_cast<double>(i) : times[i].front();
    if (!(seconds >= 0.0 && seconds < 4e9)) {
      fail((root / "times.txt").string() + " line " + std::to_string(i + 1) +
           ": the time must be from 0 to 4e9 s, as ROS stamps are");
    }
    stamps_.push_back(kFirstStamp + static_cast<std::uint64_t>(std::llround(seconds * 1e9)));
  }
}

SequenceFrame Sequence::read(std::size_t i) const {
  const fs::path scan = fs::path(folder_) / "velodyne" / (names_[i] + ".bin");
  const fs::path label = fs::path(folder_) / labels_ / (names_[i] + ".label");
  const auto values = readBinary<float>(scan, 4 * sizeof(float));
  SequenceFrame frame;
  frame.labels = readBinary<std::uint32_t>(label, sizeof(std::uint32_t));
  if (frame.labels.size() != values.size() / 4) {
    fail(label.string() + " has " + std::to_string(frame.labels.size()) + " labels, but " + scan.string() +
         " has " + std::to_string(values.size() / 4) + " points; they must be as many");
  }
  for (std::uint32_t& raw : frame.labels) raw &= 0xffffu;  // the upper half is the instance
  frame.points.reserve(values.size() / 4);
  frame.remissions.reserve(values.size() / 4);
  for (std::size_t p = 0; p < values.size(); p += 4) {
    frame.points.emplace_back(values[p], values[p + 1], values[p + 2]);
    frame.remissions.push_back(values[p + 3]);
  }
  frame.T_map_sensor = poses_[i];
  frame.stamp = stamps_[i];
  return frame;
}

}  // namespace bki_mapping
