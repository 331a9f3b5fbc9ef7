#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/sequence/sequence.h"
#include "core/counted.h"
#include "sequence/pcd_file.h"
#include "sequence/pose_file.h"
#include "sequence/scan_tables.h"

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

}  // namespace

Sequence::Sequence(const std::string& folder, const SequenceOptions& options)
    : folder_(folder), labels_(options.labels), labelled_(!options.labels.empty()) {
  const fs::path root(folder), pcd = root / "pcd", scans = root / "velodyne";
  const ScanTimes times(root / "times.txt");
  // Faults are kept for the scans that they concern, which need not be asked for.
  const auto add = [&](std::size_t number, const std::string& name, const auto& pose_at) {
    Entry& entry = scans_.emplace_back(Entry{number, name, ""});
    try {
      const double seconds =
          times.of(number, name);  // first: where both lack a line, the error names the times
      entry.stamp = kFirstStamp + static_cast<std::uint64_t>(std::llround(seconds * 1e9));
      entry.T_map_sensor = pose_at(seconds);
    } catch (const std::runtime_error& fault) {
      entry.fault = fault.what();
    }
  };
  if (fs::is_directory(pcd) && !fs::is_directory(scans)) {
    layout_ = SequenceLayout::kDynamicMap;
    if (!options.map_poses.empty() || options.poses_in) {
      fail((options.map_poses.empty() ? "the frame of poses" : options.map_poses) +
           std::string(" cannot be given for ") + pcd.string() +
           ", whose files have the poses of their scans; leave it out");
    }
    if (labels_ == SequenceOptions().labels) labelled_ = fs::is_directory(root / labels_);
    checkLabels();
    for (const auto& [number, name] : scanNames(pcd, ".pcd")) {
      const std::string file = (pcd / (name + ".pcd")).string();
      add(number, name, [&](double) { return readPcdViewpoint(file); });
    }
    return;
  }
  const auto names = scanNames(scans, ".bin");
  checkLabels();
  const ScanPoses poses(options.map_poses.empty() ? root / "poses.txt" : fs::path(options.map_poses),
                        times.given());
  poses_in_ = options.poses_in.value_or(poses.stamped() ? PosesIn::kLidar : PosesIn::kCamera);
  Eigen::Isometry3d T_camera_sensor = Eigen::Isometry3d::Identity();
  if (poses_in_ == PosesIn::kCamera) T_camera_sensor = readCalibration((root / "calib.txt").string());
  const auto of_sensor = [&](const Eigen::Isometry3d& pose) {
    return Eigen::Isometry3d(T_camera_sensor.inverse() * pose * T_camera_sensor);
  };
  const Eigen::Isometry3d T_first =
      options.map_poses.empty() ? of_sensor(poses.first()) : Eigen::Isometry3d::Identity();
  for (const auto& [number, name] : names) {
    add(number, name, [&, scan = number, called = name](double seconds) {
      return Eigen::Isometry3d(T_first.inverse() * of_sensor(poses.of(scan, called, seconds)));
    });
  }
}

void Sequence::checkLabels() const {
  const fs::path folder = fs::path(folder_) / labels_;
  if (!labelled_ || fs::is_directory(folder)) return;
  fail(
      folder.string() +
      " is not a folder; name one with labels, or say --labels none for scans without labels, with --classes "
      "occupancy");
}

const Sequence::Entry& Sequence::placed(std::size_t i) const {
  const Entry& entry = scans_[i];
  if (!entry.fault.empty()) fail(entry.fault);
  return entry;
}

const Eigen::Isometry3d& Sequence::pose(std::size_t i) const {
  return placed(i).T_map_sensor;
}

std::uint64_t Sequence::stamp(std::size_t i) const {
  return placed(i).stamp;
}

std::string Sequence::gaps() const {
  constexpr std::size_t kMaxNamed = 10;
  std::string text;
  std::size_t missing = 0, ranges = 0;
  for (std::size_t i = 1; i < scans_.size(); ++i) {
    const std::size_t from = scans_[i - 1].number + 1, to = scans_[i].number - 1;
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
      fs::path(folder_) / (is_pcd ? "pcd" : "velodyne") / (name(i) + (is_pcd ? ".pcd" : ".bin"));
  SequenceFrame frame;
  frame.T_map_sensor = pose(i);
  frame.stamp = stamp(i);
  if (is_pcd) {
    readPcd(scan.string(), frame);
  } else {
    readVelodyne(scan, frame);
  }
  if (!labelled_) {
    frame.labels.assign(frame.points.size(), 0);
    return frame;
  }
  const fs::path label = fs::path(folder_) / labels_ / (name(i) + ".label");
  frame.labels = readBinary<std::uint32_t>(label, sizeof(std::uint32_t));
  if (frame.labels.size() != frame.points.size()) {
    fail(label.string() + " has " + std::to_string(frame.labels.size()) + " labels, but " + scan.string() +
         " has " + std::to_string(frame.points.size()) + " points; they must be as many");
  }
  return frame;
}

}  // namespace bki_mapping
