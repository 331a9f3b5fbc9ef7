#include "export/cleaned_points.h"

#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/rules/voxel_state.h"
#include "core/atomic_file.h"
#include "core/float_origin.h"

namespace bki_mapping {
namespace {

/// The header; of the same length for any count, so that the count can be set at the end.
std::string header(std::uint64_t count, const Eigen::Vector3d& origin) {
  if (count > std::numeric_limits<std::uint32_t>::max()) {
    throw std::runtime_error(std::to_string(count) +
                             " points are more than a PCD file can hold; take fewer scans");
  }
  std::ostringstream digits;
  digits << std::setw(std::numeric_limits<std::uint32_t>::digits10 + 1) << std::setfill('0') << count;
  return "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z intensity label class\n"
         "SIZE 4 4 4 4 4 1\nTYPE F F F F U U\nCOUNT 1 1 1 1 1 1\nWIDTH " +
         digits.str() + "\nHEIGHT 1\nVIEWPOINT " + numberText(origin.x()) + " " + numberText(origin.y()) +
         " " + numberText(origin.z()) + " 1 0 0 0\nPOINTS " + digits.str() + "\nDATA binary\n";
}

/// Appends the points of a scan that lie in occupied voxels, relative to an origin.
void append(std::string& bytes, const SequenceFrame& frame, const SemanticMap& map, const StateRules& rules,
            const Eigen::Vector3d& origin) {
  const Scan scan = frame.scan();
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const Eigen::Vector3d point = scan.origin + scan.points[i].cast<double>();
    if (!map.geometry().contains(point)) continue;
    const VoxelView view = viewWithoutEntropy(map, rules, map.geometry().voxelAt(point));
    if (view.state != VoxelState::kOccupied) continue;
    const Eigen::Vector3f rounded = (point - origin).cast<float>();
    const CleanedPoint cleaned = {rounded.x(),         rounded.y(),    rounded.z(),
                                  frame.remissions[i], scan.labels[i], view.label};
    bytes.append(reinterpret_cast<const char*>(&cleaned), sizeof cleaned);
  }
}

}  // namespace

void checkPointFileName(const std::string& path) {
  if (std::filesystem::path(path).extension() != ".pcd") {
    throw std::invalid_argument("point file '" + path + "' must end in .pcd");
  }
}

CleanedCount writeCleanedPoints(const std::string& path, const Sequence& sequence,
                                const std::vector<std::size_t>& scans, const SemanticMap& map,
                                const StateRules& rules, const std::function<bool(std::size_t)>& progress) {
  checkPointFileName(path);
  CleanedCount count;
  const Eigen::Vector3d origin =
      scans.empty() ? Eigen::Vector3d::Zero()
                    : floatOrigin(sequence.pose(scans.front()).translation(), map.geometry().resolution());
  AtomicFile file(path);
  file.write(header(0, origin));
  std::string bytes;
  for (const std::size_t i : scans) {
    const SequenceFrame frame = sequence.read(i);
    bytes.clear();
    append(bytes, frame, map, rules, origin);
    file.write(bytes);
    count.points += frame.points.size();
    count.kept += bytes.size() / sizeof(CleanedPoint);
    ++count.scans;
    if (progress && !progress(count.scans)) break;
  }
  std::fstream begin(file.temporaryPath(), std::ios::binary | std::ios::in | std::ios::out);
  begin << header(count.kept, origin) << std::flush;
  if (!begin) throw writeFailure(path, "its header cannot be completed");
  file.commit();
  return count;
}

}  // namespace bki_mapping
