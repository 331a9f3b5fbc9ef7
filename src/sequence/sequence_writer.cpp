#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/sequence/sequence.h"
#include "core/atomic_file.h"
#include "core/float_origin.h"
#include "sequence/pcd_file.h"
#include "sequence/pose_file.h"

namespace bki_mapping {
namespace {

namespace fs = std::filesystem;

template <typename T>
void writeBinary(const fs::path& path, const std::vector<T>& values) {
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(values.data()),
            static_cast<std::streamsize>(values.size() * sizeof(T)));
  out.close();
  if (!out) throw writeFailure(path.string(), std::strerror(errno));
}

/// Creates a folder. @param instead what to do if there are files in it.
void makeEmptyFolder(const fs::path& path, const std::string& instead) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error) throw std::runtime_error(path.string() + " cannot be made: " + error.message());
  if (!fs::is_empty(path)) throw std::runtime_error(path.string() + " is not empty; " + instead);
}

}  // namespace

LabelWriter::LabelWriter(const std::string& sequence, const std::string& labels)
    : folder_((fs::path(sequence) / labels).string()) {
  makeEmptyFolder(folder_, "give a new folder, or remove the old labels first");
}

void LabelWriter::write(const std::string& name, const std::vector<std::uint32_t>& labels) const {
  writeBinary(fs::path(folder_) / (name + ".label"), labels);
}

SequenceWriter::SequenceWriter(const std::string& folder, SequenceLayout layout,
                               const Eigen::Isometry3d& T_camera_sensor)
    : folder_(folder), layout_(layout), T_camera_sensor_(T_camera_sensor) {
  for (const char* name : {layout == SequenceLayout::kDynamicMap ? "pcd" : "velodyne", "labels"}) {
    makeEmptyFolder(fs::path(folder) / name, "give a new folder, or remove the old scans first");
  }
}

void SequenceWriter::write(const SequenceFrame& frame) {
  char name[16];
  std::snprintf(name, sizeof(name), "%06zu", count_++);
  if (layout_ == SequenceLayout::kDynamicMap) {
    const Eigen::Vector3d origin = floatOrigin(frame.T_map_sensor.translation(), kFineVoxel);
    std::vector<Eigen::Vector3f> points;
    points.reserve(frame.points.size());
    for (const Eigen::Vector3f& point : frame.points)
      points.push_back((frame.T_map_sensor * point.cast<double>() - origin).cast<float>());
    writePcdPoints((fs::path(folder_) / "pcd" / (std::string(name) + ".pcd")).string(), points, origin,
                   frame.remissions, frame.T_map_sensor);
  } else {
    std::vector<float> values;
    values.reserve(4 * frame.points.size());
    for (std::size_t i = 0; i < frame.points.size(); ++i) {
      values.insert(values.end(),
                    {frame.points[i].x(), frame.points[i].y(), frame.points[i].z(), frame.remissions[i]});
    }
    writeBinary(fs::path(folder_) / "velodyne" / (std::string(name) + ".bin"), values);
  }
  writeBinary(fs::path(folder_) / "labels" / (std::string(name) + ".label"), frame.labels);

  std::ostringstream time;
  time.precision(9);
  time << std::fixed << static_cast<double>(frame.stamp - Sequence::kFirstStamp) * 1e-9;
  poses_ += rowOf(T_camera_sensor_ * frame.T_map_sensor * T_camera_sensor_.inverse()) + "\n";
  times_ += time.str() + "\n";
}

void SequenceWriter::finish() {
  writeTextFile((fs::path(folder_) / "times.txt").string(), times_);
  if (layout_ == SequenceLayout::kDynamicMap) return;
  writeTextFile((fs::path(folder_) / "poses.txt").string(), poses_);
  writeTextFile((fs::path(folder_) / "calib.txt").string(), "Tr: " + rowOf(T_camera_sensor_) + "\n");
}

}  // namespace bki_mapping
