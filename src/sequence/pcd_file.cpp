#include "sequence/pcd_file.h"

#include <pcl/io/pcd_io.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>

#include "core/atomic_file.h"

namespace bki_mapping {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& text) {
  throw std::runtime_error(path + " " + text);
}

/// The words of each line of a header, by the first word.
struct Header {
  std::map<std::string, std::vector<std::string>> lines;
  std::uintmax_t bytes = 0;  ///< length of the header
};

Header readHeader(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path)) fail(path, "cannot be read; check the sequence's folder");
  std::string begin(1 << 16, '\0');
  file.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  begin.resize(static_cast<std::size_t>(file.gcount()));
  std::istringstream text(begin);
  Header header;
  for (std::string line; std::getline(text, line);) {
    header.bytes += line.size() + 1;
    std::istringstream words(line);
    std::string name;
    words >> name;
    for (std::string word; words >> word;) header.lines[name].push_back(word);
    if (name == "DATA") return header;
  }
  fail(path, "is no PCD file: its header has no line DATA");
}

/// The numbers of a line. @param least, most limits of each.
std::vector<double> numbersOf(const Header& header, const std::string& name, double least, double most,
                              const std::string& path) {
  std::vector<double> numbers;
  const auto line = header.lines.find(name);
  if (line == header.lines.end()) return numbers;
  for (const std::string& word : line->second) {
    char* end = nullptr;
    numbers.push_back(std::strtod(word.c_str(), &end));
    if (*end == '\0' && numbers.back() >= least && numbers.back() <= most) continue;
    fail(path, "has '" + word + "' in line " + name + " of its header, which must be a number" +
                   (most < std::numeric_limits<double>::max() ? " of at most " + std::to_string(most) : ""));
  }
  return numbers;
}

/// Compares the number of points with the size of the file, before PCL takes memory for them.
void checkSize(const Header& header, const std::string& path) {
  constexpr double kMostPoints = std::numeric_limits<std::uint32_t>::max(), kMostField = 4096;
  const auto points = numbersOf(header, "POINTS", 0, kMostPoints, path);
  const auto sizes = numbersOf(header, "SIZE", 1, 8, path);
  auto counts = numbersOf(header, "COUNT", 0, kMostField, path);
  if (counts.empty()) counts.assign(sizes.size(), 1.0);
  const auto fields = header.lines.find("FIELDS");
  const bool fits = fields != header.lines.end() && fields->second.size() == sizes.size();
  if (points.size() != 1 || !fits || counts.size() != sizes.size()) {
    fail(path, "has an incomplete header; it needs FIELDS, SIZE, TYPE and POINTS");
  }
  double record = 0.0, words = 0.0;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    record += sizes[i] * counts[i];
    words += counts[i];
  }
  // A number of ASCII takes two characters and more; LZF packs 264 bytes into three at best.
  const std::string& data = header.lines.at("DATA").empty() ? "" : header.lines.at("DATA").front();
  const double least = data == "ascii" ? 2.0 * words : data == "binary" ? record : record / 88.0;
  const auto bytes = static_cast<double>(std::filesystem::file_size(path) - header.bytes);
  if (points[0] * record > kMostPoints || points[0] * least > bytes + 1.0) {
    fail(path, "has too few bytes for the " + header.lines.at("POINTS").front() +
                   " points of its header; it is truncated");
  }
  if (data != "binary_compressed" || points[0] == 0.0) return;
  std::uint32_t packed[2] = {};  // sizes of the data: packed, unpacked
  std::ifstream file(path, std::ios::binary);
  file.seekg(static_cast<std::streamoff>(header.bytes));
  file.read(reinterpret_cast<char*>(packed), sizeof packed);
  if (!file || packed[0] + 8.0 > bytes || packed[1] != points[0] * record) {
    fail(path, "has compressed data of another size than its header says; it is damaged");
  }
}

/// The values of a field; none if the cloud has no such field.
std::vector<double> valuesOf(const pcl::PCLPointCloud2& cloud, const std::string& name) {
  std::vector<double> values;
  for (const pcl::PCLPointField& field : cloud.fields) {
    if (field.name != name || field.count == 0) continue;
    const auto read = [&](auto number) {
      for (std::size_t at = field.offset; at + sizeof number <= cloud.data.size(); at += cloud.point_step) {
        std::memcpy(&number, cloud.data.data() + at, sizeof number);
        values.push_back(static_cast<double>(number));
      }
    };
    switch (field.datatype) {
      case pcl::PCLPointField::INT8:
        read(std::int8_t{});
        break;
      case pcl::PCLPointField::UINT8:
        read(std::uint8_t{});
        break;
      case pcl::PCLPointField::INT16:
        read(std::int16_t{});
        break;
      case pcl::PCLPointField::UINT16:
        read(std::uint16_t{});
        break;
      case pcl::PCLPointField::INT32:
        read(std::int32_t{});
        break;
      case pcl::PCLPointField::UINT32:
        read(std::uint32_t{});
        break;
      case pcl::PCLPointField::FLOAT32:
        read(float{});
        break;
      case pcl::PCLPointField::FLOAT64:
        read(double{});
        break;
    }
    break;
  }
  return values;
}

}  // namespace

PcdPoints readPcdPoints(const std::string& path) {
  const Header header = readHeader(path);
  checkSize(header, path);
  if (std::stod(header.lines.at("POINTS").front()) == 0.0) return {};  // PCL 1.11 refuses empty clouds
  pcl::PCLPointCloud2 cloud;
  try {
    if (pcl::PCDReader().read(path, cloud) < 0) fail(path, "is damaged: PCL cannot read it");
  } catch (const pcl::PCLException& fault) {
    fail(path, std::string("is damaged: ") + fault.what());
  }
  const auto x = valuesOf(cloud, "x"), y = valuesOf(cloud, "y"), z = valuesOf(cloud, "z");
  const std::size_t count = std::size_t{cloud.width} * cloud.height;
  if (x.size() != count || y.size() != count || z.size() != count) {
    fail(path, "lacks one of the fields x, y and z");
  }
  PcdPoints points;
  points.points.reserve(count);
  for (std::size_t i = 0; i < count; ++i) points.points.emplace_back(x[i], y[i], z[i]);
  points.intensity = valuesOf(cloud, "intensity");
  points.label = valuesOf(cloud, "label");
  return points;
}

Eigen::Isometry3d readPcdViewpoint(const std::string& path) {
  constexpr double kMost = std::numeric_limits<double>::max();
  const auto v = numbersOf(readHeader(path), "VIEWPOINT", -kMost, kMost, path);
  if (v.size() != 7) {
    fail(path, "has no line VIEWPOINT with 7 numbers (x y z qw qx qy qz); it needs the pose of the sensor");
  }
  const Eigen::Quaterniond rotation(v[3], v[4], v[5], v[6]);
  if (!(std::abs(rotation.norm() - 1.0) < 0.1)) {
    fail(path,
         "has a VIEWPOINT whose quaternion has length " + std::to_string(rotation.norm()) + " instead of 1");
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = rotation.normalized().toRotationMatrix();
  pose.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
  return pose;
}

void writePcdPoints(const std::string& path, const std::vector<Eigen::Vector3f>& points,
                    const Eigen::Vector3d& origin, const std::vector<float>& intensity,
                    const Eigen::Isometry3d& viewpoint) {
  const bool far = !origin.isZero(0.0);
  const std::string size = far ? "8" : "4";
  const Eigen::Vector3d at = viewpoint.translation();
  const Eigen::Quaterniond q(viewpoint.linear());
  std::ostringstream header;
  header.precision(17);
  header << "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity\nSIZE " << size
         << ' ' << size << ' ' << size << " 4\n"
         << "TYPE F F F F\nCOUNT 1 1 1 1\nWIDTH " << points.size() << "\nHEIGHT 1\nVIEWPOINT " << at.x()
         << " " << at.y() << " " << at.z() << " " << q.w() << " " << q.x() << " " << q.y() << " " << q.z()
         << "\nPOINTS " << points.size() << "\nDATA binary\n";
  std::string bytes = header.str();
  const auto append = [&bytes](const auto& value) {
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  bytes.reserve(bytes.size() + (far ? 28 : 16) * points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const Eigen::Index axis : {0, 1, 2}) {
      far ? append(origin[axis] + static_cast<double>(points[i][axis])) : append(points[i][axis]);
    }
    append(intensity[i]);
  }
  writeTextFile(path, bytes);
}

}  // namespace bki_mapping
