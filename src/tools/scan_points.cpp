#include "tools/scan_points.h"

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "bki_mapping/core/named_parameter.h"
#include "core/atomic_file.h"
#include "core/float_origin.h"
#include "journal/scan_codec.h"

namespace bki_mapping::tools {
namespace {

/// A point as it lies in the file, with coordinates of either precision.
template <typename Real>
struct [[gnu::packed]] PlyPoint {
  Real x, y, z;  ///< map frame [m]
  std::uint8_t red, green, blue;
  std::uint32_t label;  ///< as it was recorded
  std::uint8_t id;      ///< of the class; kFreeClass: the table has none for the label
};
struct [[gnu::packed]] PcdPoint {
  float x, y, z;      ///< relative to the file's VIEWPOINT, map frame [m]
  std::uint32_t rgb;  ///< as PCL packs it: red in bits 16 to 23, green, blue
  std::uint32_t label;
  std::uint8_t id;
};

struct Format {
  bool ply = true;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< of floats [m]

  bool hasDoubles() const { return ply && !origin.isZero(0.0); }
};

/// The header; of the same length for any count, so that the count can be set at the end.
std::string headerOf(const Format& format, std::uint64_t count) {
  if (count > std::numeric_limits<std::uint32_t>::max()) {
    throw std::runtime_error(std::to_string(count) +
                             " points are more than a .ply or .pcd file can hold; give a --box");
  }
  std::ostringstream digits;
  digits << std::setw(std::numeric_limits<std::uint32_t>::digits10 + 1) << std::setfill('0') << count;
  if (format.ply) {
    const std::string real = format.hasDoubles() ? "double" : "float";
    return "ply\nformat binary_little_endian 1.0\nelement vertex " + digits.str() + "\nproperty " + real +
           " x\nproperty " + real + " y\nproperty " + real +
           " z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty uint label\n"
           "property uchar class\nend_header\n";
  }
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z rgb label class\n"
         "SIZE 4 4 4 4 4 1\nTYPE F F F F U U\nCOUNT 1 1 1 1 1 1\nWIDTH " +
         digits.str() + "\nHEIGHT 1\nVIEWPOINT " + numberText(format.origin.x()) + " " +
         numberText(format.origin.y()) + " " + numberText(format.origin.z()) + " 1 0 0 0\nPOINTS " +
         digits.str() + "\nDATA binary\n";
}

template <typename Point>
void append(std::string& bytes, const Point& point) {
  bytes.append(reinterpret_cast<const char*>(&point), sizeof point);
}

void append(std::string& bytes, const Format& format, const Eigen::Vector3d& point, std::uint32_t label,
            const ClassTable& classes, LabelValues values) {
  const auto known = classes.classOf(label, values);
  const SemanticClass* const its = known ? classes.find(*known) : nullptr;
  const auto [red, green, blue] = its ? its->color : decltype(SemanticClass::color){};
  const ClassId id = known.value_or(kFreeClass);
  const Eigen::Vector3f rounded = (point - format.origin).cast<float>();
  if (!format.ply) {
    const auto rgb = static_cast<std::uint32_t>(red << 16 | green << 8 | blue);
    append(bytes, PcdPoint{rounded.x(), rounded.y(), rounded.z(), rgb, label, id});
  } else if (format.hasDoubles()) {
    append(bytes, PlyPoint<double>{point.x(), point.y(), point.z(), red, green, blue, label, id});
  } else {
    append(bytes, PlyPoint<float>{rounded.x(), rounded.y(), rounded.z(), red, green, blue, label, id});
  }
}

Format formatOf(const std::string& path, const MapInfo& info, const ScanRecord& first) {
  const std::string extension = std::filesystem::path(path).extension().string();
  if (extension != ".ply" && extension != ".pcd") {
    throw std::invalid_argument("--points: the file, " + path + ", must end in .ply or .pcd");
  }
  return {extension == ".ply", floatOrigin(first.T_map_sensor.translation(), info.resolution)};
}

SensorScan scanOf(MapFile& file, std::uint64_t number) {
  try {
    return unpackScan(file.scanContent(number));
  } catch (const ScanDamaged& fault) {
    throw MapFileDamaged("scan " + std::to_string(number) + " of " + file.path() +
                         " is damaged: " + fault.what());
  }
}

}  // namespace

ScanPointCount writeScanPoints(const std::string& path, MapFile& file, const Eigen::AlignedBox3d& box,
                               const std::function<void(std::size_t, std::size_t)>& progress) {
  const std::vector<ScanRecord> scans = file.hasJournal() ? file.scans() : std::vector<ScanRecord>();
  if (scans.empty()) throw MapFileError(file.path() + " has no scans in its journal, and so no points");
  const Format format = formatOf(path, file.info(), scans.front());
  ScanPointCount count;
  AtomicFile output(path);
  output.write(headerOf(format, 0));
  std::string bytes;
  for (const ScanRecord& record : scans) {
    const SensorScan kept = scanOf(file, record.number);
    const Scan scan = place(kept, record.T_map_sensor);
    const LabelValues values = kept.labels_are_ids ? LabelValues::kId : LabelValues::kRaw;
    bytes.clear();
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
      const Eigen::Vector3d point = scan.origin + scan.points[i].cast<double>();
      if (!box.contains(point)) continue;
      append(bytes, format, point, scan.labels[i], *file.info().classes, values);
      ++count.points;
    }
    output.write(bytes);
    progress(++count.scans, scans.size());
  }
  std::fstream begin(output.temporaryPath(), std::ios::binary | std::ios::in | std::ios::out);
  begin << headerOf(format, count.points) << std::flush;
  if (!begin) throw writeFailure(path, "its header cannot be completed");
  output.commit();
  return count;
}

}  // namespace bki_mapping::tools
