#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/io/sequence.h"
#include "io/pcd_file.h"

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

/// The numbers of each line; trailing empty lines are dropped.
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
             "' is not a finite number");
      }
    }
    lines.push_back(numbers);
  }
  while (!lines.empty() && lines.back().empty()) lines.pop_back();
  return lines;
}

/// A rigid transform from 3x4 row-major numbers; the rotation is made orthonormal.
Eigen::Isometry3d rigid(const std::vector<double>& numbers, const std::string& what) {
  if (numbers.size() != 12)
    fail(what + " has " + std::to_string(numbers.size()) + " numbers, but needs 12 (3x4)");
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(numbers.data());
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  if (!(std::abs(rotation.determinant() - 1.0) < 0.1)) {
    fail(what + " is not a rigid transform: its rotation has determinant " +
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
    fail(path.string() + " has " + std::to_string(bytes) + " bytes, which is not a multiple of " +
         std::to_string(record) + "; it is truncated or of another format");
  }
  std::vector<T> values(bytes / sizeof(T));
  file.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(bytes));
  if (!file) fail(path.string() + " cannot be read to its end");
  return values;
}

/// The file names of the scans, without their extension, by number. @param extension such as ".bin".
std::map<std::size_t, std::string> scanNames(const fs::path& folder, const std::string& extension) {
  if (!fs::is_directory(folder)) {
    fail(folder.string() + " is not a folder; give the folder of a sequence, with velodyne/ or pcd/ inside");
  }
  std::map<std::size_t, std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != extension) continue;
    const std::string name = entry.path().stem().string();
    std::size_t number = 0;
    const char* const end = name.data() + name.size();
    const auto [rest, error] = std::from_chars(name.data(), end, number);
    if (error != std::errc() || rest != end) {
      fail(entry.path().string() + " is not named by the number of its scan; rename it to NNNNNN" +
           extension + ", line NNNNNN + 1 of poses.txt being its pose, or move it elsewhere");
    }
    const auto [known, is_new] = names.emplace(number, name);
    if (!is_new) {
      fail(folder.string() + ": scans " + std::min(known->second, name) + " and " +
           std::max(known->second, name) + " have the same number; remove one");
    }
  }
  if (names.empty()) fail(folder.string() + " holds no scans (*" + extension + ")");
  return names;
}

/// The line of a scan, counted from 1.
const std::vector<double>& lineOf(const std::vector<std::vector<double>>& lines, const fs::path& file,
                                  std::size_t number, const std::string& scan) {
  if (number < lines.size()) return lines[number];
  fail(file.string() + " has no line " + std::to_string(number + 1) + " for scan " + scan + ", but " +
       std::to_string(lines.size()) + " lines; line 1 belongs to scan 000000");
}

void readVelodyne(const fs::path& path, SequenceFrame& frame) {
  const auto values = readBinary<float>(path, 4 * sizeof(float));
  frame.points.reserve(values.size() / 4);
  frame.remissions.reserve(values.size() / 4);
  for (std::size_t p = 0; p < values.size(); p += 4) {
    frame.points.emplace_back(values[p], values[p + 1], values[p + 2]);
    frame.remissions.push_back(values[p + 3]);
  }
}

/// Reads points of the map frame into the sensor frame of the frame's pose.
void readPcd(const std::string& path, SequenceFrame& frame) {
  const PcdPoints cloud = readPcdPoints(path);
  const Eigen::Isometry3d T_sensor_map = frame.T_map_sensor.inverse();
  frame.points.reserve(cloud.points.size());
  for (const Eigen::Vector3d& point : cloud.points) {
    frame.points.push_back((T_sensor_map * point).cast<float>());
  }
  frame.remissions.assign(cloud.points.size(), 0.0f);
  for (std::size_t i = 0; i < cloud.intensity.size(); ++i) {
    frame.remissions[i] = static_cast<float>(cloud.intensity[i]);
  }
}

std::string sixDigits(std::size_t number) {
  const std::string digits = std::to_string(number);
  return std::string(6 - std::min<std::size_t>(digits.size(), 6), '0') + digits;
}

}  // namespace

Sequence::Sequence(const std::string& folder, const std::string& labels, const std::string& map_poses)
    : folder_(folder), labels_(labels) {
  const fs::path root(folder), times_file = root / "times.txt";
  const fs::path poses_file = map_poses.empty() ? root / "poses.txt" : fs::path(map_poses);
  const fs::path pcd = root / "pcd", scans = root / "velodyne";
  std::vector<std::vector<double>> times;
  const bool timed = fs::exists(times_file);
  const auto secondsOf = [&](std::size_t number, const std::string& name) {
    if (!timed) return 0.1 * static_cast<double>(number);
    const auto& line = lineOf(times, times_file, number, name);
    if (line.empty()) {
      fail(times_file.string() + " line " + std::to_string(number + 1) + " is empty, but scan " + name +
           " needs a time");
    }
    return line.front();
  };
  if (fs::is_directory(pcd) && !fs::is_directory(scans)) {
    layout_ = SequenceLayout::kDynamicMap;
    if (!map_poses.empty()) {
      fail(map_poses + " cannot be used for " + pcd.string() +
           ", whose files have the poses of their scans; leave it out");
    }
    labelled_ = fs::is_directory(root / labels);
    if (!labelled_ && labels != "labels")
      fail((root / labels).string() + " is not a folder; give one with labels");
    if (timed) times = readNumberLines(times_file, "check its rights");
    for (const auto& [number, name] : scanNames(pcd, ".pcd")) {
      const double seconds = secondsOf(number, name);
      addScan(number, name, readPcdViewpoint((pcd / (name + ".pcd")).string()), seconds);
    }
    return;
  }
  const auto names = scanNames(scans, ".bin");
  const Eigen::Isometry3d T_camera_sensor = readCalibration(root / "calib.txt");
  const auto poses = readNumberLines(poses_file, "a sequence needs a pose a scan");
  if (timed) times = readNumberLines(times_file, "check its rights");
  const auto pose = [&](std::size_t number, const std::string& name) {
    const auto& numbers = lineOf(poses, poses_file, number, name);
    const std::string what = poses_file.string() + " line " + std::to_string(number + 1);
    return Eigen::Isometry3d(T_camera_sensor.inverse() * rigid(numbers, what) * T_camera_sensor);
  };
  const Eigen::Isometry3d T_first = map_poses.empty() ? pose(0, sixDigits(0)) : Eigen::Isometry3d::Identity();
  for (const auto& [number, name] : names) {
    const double seconds =
        secondsOf(number, name);  // before the pose: where both lack a line, the error names the times
    addScan(number, name, T_first.inverse() * pose(number, name), seconds);
  }
}

void Sequence::addScan(std::size_t number, const std::string& name, const Eigen::Isometry3d& T_map_sensor,
                       double seconds) {
  if (!(seconds >= 0.0 && seconds < 4e9)) {
    fail((fs::path(folder_) / "times.txt").string() + " line " + std::to_string(number + 1) +
         ": the time must be from 0 to 4e9 s, as ROS stamps are");
  }
  numbers_.push_back(number);
  names_.push_back(name);
  poses_.push_back(T_map_sensor);
  stamps_.push_back(kFirstStamp + static_cast<std::uint64_t>(std::llround(seconds * 1e9)));
}

std::string Sequence::gaps() const {
  constexpr std::size_t kMaxNamed = 10;
  std::string text;
  std::size_t missing = 0, ranges = 0;
  for (std::size_t i = 1; i < numbers_.size(); ++i) {
    const std::size_t from = numbers_[i - 1] + 1, to = numbers_[i] - 1;
    if (from > to) continue;
    missing += to - from + 1;
    if (++ranges > kMaxNamed) continue;
    text += (text.empty() ? "" : ", ") + sixDigits(from) + (from < to ? " to " + sixDigits(to) : "");
  }
  if (missing == 0) return "";
  if (ranges > kMaxNamed) text += " and others (" + std::to_string(missing) + " in all)";
  return (missing == 1 ? "scan " + text + " is" : "scans " + text + " are") + " missing in " +
         (fs::path(folder_) / (layout_ == SequenceLayout::kDynamicMap ? "pcd" : "velodyne")).string();
}

SequenceFrame Sequence::read(std::size_t i) const {
  const bool is_pcd = layout_ == SequenceLayout::kDynamicMap;
  const fs::path scan =
      fs::path(folder_) / (is_pcd ? "pcd" : "velodyne") / (names_[i] + (is_pcd ? ".pcd" : ".bin"));
  SequenceFrame frame;
  frame.T_map_sensor = poses_[i];
  frame.stamp = stamps_[i];
  if (is_pcd) {
    readPcd(scan.string(), frame);
  } else {
    readVelodyne(scan, frame);
  }
  if (!labelled_) {
    frame.labels.assign(frame.points.size(), 0);
    return frame;
  }
  const fs::path label = fs::path(folder_) / labels_ / (names_[i] + ".label");
  frame.labels = readBinary<std::uint32_t>(label, sizeof(std::uint32_t));
  if (frame.labels.size() != frame.points.size()) {
    fail(label.string() + " has " + std::to_string(frame.labels.size()) + " labels, but " + scan.string() +
         " has " + std::to_string(frame.points.size()) + " points; they must be as many");
  }
  return frame;
}

}  // namespace bki_mapping
