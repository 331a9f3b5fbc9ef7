#include "bki_mapping/export/map_export.h"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/store/mapper_file.h"
#include "core/atomic_file.h"
#include "core/float_origin.h"
#include "export/voxel_points.h"

namespace bki_mapping {
namespace {

const char kPlyProperties[] =
    "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    "property ushort label\nproperty uchar state\n"
    "property float probability\nproperty float occupancy\nproperty float class_probability\n"
    "property float variance\nproperty float entropy\nproperty float evidence\n";

/// Files do not wait for threads that may serve the mapper at the time.
constexpr int kThreads = 1;

/// The header followed by the points, of type Point. Bytes are in host order, which is little-endian on all
/// platforms of ROS 1.
template <typename Point, typename... Origin>
std::string withPoints(std::string header, const VoxelPoints& points, const Origin&... origin) {
  const std::size_t begin = header.size();
  header.resize(begin + points.count() * sizeof(Point));
  points.write(reinterpret_cast<Point*>(header.data() + begin), origin...);
  return header;
}

std::string plyBytes(const VoxelPoints& points, double resolution, bool far) {
  const std::string type = far ? "double" : "float";
  std::ostringstream header;
  header << "ply\nformat binary_little_endian 1.0\ncomment bki_mapping voxels, resolution " << resolution
         << " m, map frame\nelement vertex " << points.count() << "\n";
  for (const char axis : {'x', 'y', 'z'}) header << "property " << type << ' ' << axis << '\n';
  header << kPlyProperties << "end_header\n";
  return far ? withPoints<VoxelRecord>(header.str(), points)
             : withPoints<FloatVoxelRecord>(header.str(), points);
}

std::string pcdBytes(const VoxelPoints& points, const Eigen::Vector3d& origin) {
  if (points.count() > std::numeric_limits<std::uint32_t>::max() / sizeof(VoxelPoint)) {
    throw std::length_error(std::to_string(points.count()) + " voxels are more than a PCD file can hold");
  }
  std::ostringstream names, sizes, types, counts, header;
  for (const VoxelField& field : kVoxelFields) {
    names << ' ' << field.name;
    sizes << ' ' << field.bytes();
    types << ' ' << (field.type == VoxelField::kFloat32 ? 'F' : 'U');
    counts << " 1";
  }
  // PCL's own writer maps the file into memory, and the process dies if the disk fills up meanwhile.
  header << "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS" << names.str() << "\nSIZE"
         << sizes.str() << "\nTYPE" << types.str() << "\nCOUNT" << counts.str() << "\nWIDTH "
         << points.count() << "\nHEIGHT 1\nVIEWPOINT " << numberText(origin.x()) << ' '
         << numberText(origin.y()) << ' ' << numberText(origin.z()) << " 1 0 0 0\nPOINTS " << points.count()
         << "\nDATA binary\n";
  return withPoints<VoxelPoint>(header.str(), points, origin);
}

std::string bytesOf(const std::string& ending, const SemanticMap& map, const StateRules& rules,
                    const ClassTable& classes, const VoxelStates& states) {
  const GridGeometry& geometry = map.geometry();
  const VoxelPoints::Blocks blocks = sortedBlocks(map);
  ThreadPool pool(kThreads);
  const VoxelPoints points(map, rules, classes, {states}, blocks, pool);
  if (ending == ".pcd") return pcdBytes(points, pcdOrigin(map));
  const bool far = std::any_of(blocks.begin(), blocks.end(), [&](const auto& block) {
    return tooFarForFloats(geometry.blockCentre(block.first), geometry.resolution());
  });
  return plyBytes(points, geometry.resolution(), far);
}

std::string endingOf(const std::string& path) {
  return std::filesystem::path(path).extension().string();
}

bool holdsPoints(const std::string& path) {
  return endingOf(path) == ".ply" || endingOf(path) == ".pcd";
}

}  // namespace

VoxelStates parseStates(const std::string& list) {
  VoxelStates states;
  std::istringstream words(list);
  for (std::string word; std::getline(words, word, ',');) {
    if (word == "occupied") {
      states.insert(VoxelState::kOccupied);
    } else if (word == "free") {
      states.insert(VoxelState::kFree);
    } else if (word == "occluded") {
      states.insert(VoxelState::kOccluded);
    } else {
      throw std::invalid_argument("voxel state '" + word +
                                  "' is unknown; known states: occupied, free, occluded");
    }
  }
  return states;
}

std::vector<VoxelRecord> collectVoxels(const SemanticMap& map, const StateRules& rules,
                                       const ClassTable& classes, const VoxelStates& states) {
  ThreadPool pool(kThreads);
  const VoxelPoints points(map, rules, classes, {states}, sortedBlocks(map), pool);
  std::vector<VoxelRecord> voxels(points.count());
  points.write(voxels.data());
  return voxels;
}

Eigen::Vector3d pcdOrigin(const SemanticMap& map) {
  return floatOrigin(placeOf(map.geometry(), sortedBlocks(map)), map.geometry().resolution());
}

void checkMapName(const std::string& path) {
  if (!isMapFileName(path) && !holdsPoints(path)) {
    throw std::invalid_argument(
        "map file '" + path +
        "' must end in .bkm, which holds all of a map, or in .ply or .pcd, which hold its voxels as points");
  }
}

void exportMap(const std::string& path, const SemanticMap& map, const StateRules& rules,
               const ClassTable& classes, const VoxelStates& states) {
  if (!holdsPoints(path)) throw std::invalid_argument("point file '" + path + "' must end in .ply or .pcd");
  AtomicFile file(path);
  file.write(bytesOf(endingOf(path), map, rules, classes, states));
  file.commit();
}

}  // namespace bki_mapping
