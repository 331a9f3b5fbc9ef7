#include "bki_mapping/io/map_export.h"

#include <pcl/io/pcd_io.h>

#include <filesystem>
#include <sstream>
#include <stdexcept>

#include "io/atomic_file.h"
#include "io/little_endian.h"
#include "io/voxel_pcl.h"
#include "map/voxel_color.h"

namespace bki_mapping {
namespace {

const char kPlyProperties[] =
    "property float x\nproperty float y\nproperty float z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n"
    "property ushort label\nproperty uchar state\n"
    "property float probability\nproperty float occupancy\nproperty float class_probability\n"
    "property float variance\nproperty float entropy\nproperty float evidence\n";

std::string plyBytes(const std::vector<VoxelRecord>& voxels, double resolution) {
  std::ostringstream header;
  header << "ply\nformat binary_little_endian 1.0\ncomment bki_mapping voxels, resolution " << resolution
         << " m, map frame\nelement vertex " << voxels.size() << "\n"
         << kPlyProperties << "end_header\n";
  std::string bytes = header.str();
  for (const VoxelRecord& v : voxels) {
    for (const float c : {v.x, v.y, v.z}) appendBytes(bytes, c);
    for (const std::uint8_t c : {v.red, v.green, v.blue}) appendBytes(bytes, c);
    appendBytes(bytes, v.label);
    appendBytes(bytes, v.state);
    for (const float f :
         {v.probability, v.occupancy, v.class_probability, v.variance, v.entropy, v.evidence}) {
      appendBytes(bytes, f);
    }
  }
  return bytes;
}

std::string pcdBytes(const std::vector<VoxelRecord>& voxels) {
  const pcl::PCLPointCloud2 cloud = toPcl(voxels);
  // PCL's own writer maps the file into memory, and the process dies if the disk fills up meanwhile.
  return pcl::PCDWriter().generateHeaderBinary(cloud, Eigen::Vector4f::Zero(),
                                               Eigen::Quaternionf::Identity()) +
         "DATA binary\n" + std::string(cloud.data.begin(), cloud.data.end());
}

std::string endingOf(const std::string& path) {
  return std::filesystem::path(path).extension().string();
}

}  // namespace

std::set<VoxelState> parseStates(const std::string& list) {
  std::set<VoxelState> states;
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

void appendVoxels(const SemanticMap& map, const ClassTable& classes, const std::set<VoxelState>& states,
                  const BlockIndex& index, const Block& block, std::vector<VoxelRecord>& voxels) {
  for (int offset = 0; offset < kBlockVoxels; ++offset) {
    if (states.count(viewWithoutEntropy(map, block, offset).state) == 0) continue;
    const VoxelView view = viewVoxel(map, block, offset);
    const VoxelIndex voxel = GridGeometry::voxelOf(index, offset);
    const Eigen::Vector3f centre = map.geometry().voxelCentre(voxel).cast<float>();
    const Color color = semanticColor(view, classes);
    voxels.push_back({centre.x(), centre.y(), centre.z(), color[0], color[1], color[2], view.label,
                      static_cast<std::uint8_t>(view.state), view.probability, view.occupancy,
                      view.class_probability, view.variance, view.entropy, view.evidence});
  }
}

std::vector<VoxelRecord> collectVoxels(const SemanticMap& map, const ClassTable& classes,
                                       const std::set<VoxelState>& states) {
  std::vector<VoxelRecord> voxels;
  for (const auto& [index, block] : sortedBlocks(map)) {
    appendVoxels(map, classes, states, index, *block, voxels);
  }
  return voxels;
}

void checkMapFileName(const std::string& path) {
  const std::string ending = endingOf(path);
  if (ending != ".ply" && ending != ".pcd") {
    throw std::invalid_argument("map file '" + path + "' must end in .ply or .pcd");
  }
}

void exportMap(const std::string& path, const SemanticMap& map, const ClassTable& classes,
               const std::set<VoxelState>& states) {
  checkMapFileName(path);
  const std::vector<VoxelRecord> voxels = collectVoxels(map, classes, states);
  AtomicFile file(path);
  file.write(endingOf(path) == ".ply" ? plyBytes(voxels, map.geometry().resolution()) : pcdBytes(voxels));
  file.commit();
}

}  // namespace bki_mapping
