#include "export/open_faces.h"

#include <array>
#include <stdexcept>

#include "bki_mapping/query/state_map.h"

namespace bki_mapping {
namespace {

constexpr int kCorners = kBlockEdge + 1;  ///< of voxels along an edge of a block

/// The faces of a voxel: the neighbour beyond it, and its corners, counterclockwise as seen from there.
struct Face {
  int x, y, z;
  int corners[4][3];
};
constexpr Face kFaces[] = {
    {-1, 0, 0, {{0, 0, 0}, {0, 0, 1}, {0, 1, 1}, {0, 1, 0}}},
    {1, 0, 0, {{1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {1, 0, 1}}},
    {0, -1, 0, {{0, 0, 0}, {1, 0, 0}, {1, 0, 1}, {0, 0, 1}}},
    {0, 1, 0, {{0, 1, 0}, {0, 1, 1}, {1, 1, 1}, {1, 1, 0}}},
    {0, 0, -1, {{0, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, 0, 0}}},
    {0, 0, 1, {{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}},
};

/// A block and the six around it.
class Surroundings {
 public:
  Surroundings(BlockReader& states, const BlockIndex& index) : centre_(states.find(index)) {
    for (std::size_t n = 0; n < beyond_.size(); ++n) {
      const Face& face = kFaces[n];
      beyond_[n] = states.find({index.x + face.x, index.y + face.y, index.z + face.z});
    }
  }
  /// @param x, y, z of a voxel of the block. @param face of the voxel.
  bool isOpen(int x, int y, int z, std::size_t face) const {
    const int nx = x + kFaces[face].x, ny = y + kFaces[face].y, nz = z + kFaces[face].z;
    const auto inside = [](int along) { return along >= 0 && along < kBlockEdge; };
    const bool here = inside(nx) && inside(ny) && inside(nz);
    const BlockStates* const block = here ? centre_ : beyond_[face];
    const auto wrapped = [](int along) { return (along + kBlockEdge) % kBlockEdge; };
    return !block || !isOccupied(*block, wrapped(nx), wrapped(ny), wrapped(nz));
  }
  static bool isOccupied(const BlockStates& block, int x, int y, int z) {
    return (block.layers[static_cast<std::size_t>(z)].occupied >> (x + kBlockEdge * y) & 1) != 0;
  }

 private:
  const BlockStates* centre_;
  std::array<const BlockStates*, 6> beyond_{};
};

/// Adds the faces of the voxels of one block; knows the corners that it has added.
class BlockFaces {
 public:
  /// @param corner the lowest of the block, from the origin [m].
  BlockFaces(const Eigen::Vector3d& corner, double resolution) : corner_(corner), resolution_(resolution) {}

  /// @param x, y, z of a voxel of the block.
  void add(const Face& face, int x, int y, int z, ClassId id, Faces& faces) {
    Numbers& numbers = numbers_[id];
    std::array<std::uint32_t, 4> corners{};
    for (std::size_t n = 0; n < corners.size(); ++n) {
      const int i = x + face.corners[n][0], j = y + face.corners[n][1], k = z + face.corners[n][2];
      std::uint32_t& number = numbers[static_cast<std::size_t>(i + kCorners * (j + kCorners * k))];
      if (number == 0) {
        faces.corners.push_back((corner_ + resolution_ * Eigen::Vector3d(i, j, k)).cast<float>());
        faces.box.extend(faces.corners.back());
        number = static_cast<std::uint32_t>(faces.corners.size());
      }
      corners[n] = number - 1;
    }
    for (const std::size_t n : {0, 1, 2, 0, 2, 3}) faces.triangles.push_back(corners[n]);
  }

 private:
  /// Numbers of corners plus 1; 0: not added.
  using Numbers = std::array<std::uint32_t, kCorners * kCorners * kCorners>;

  Eigen::Vector3d corner_;
  double resolution_;
  std::map<ClassId, Numbers> numbers_;
};

}  // namespace

std::map<ClassId, Faces> openFaces(const SemanticMap& map, const StateRules& rules,
                                   const Eigen::Vector3d& origin, std::uint64_t most_bytes) {
  const GridGeometry& geometry = map.geometry();
  const double resolution = geometry.resolution();
  const StateMap states(map, rules);
  BlockReader reader(states);
  std::map<ClassId, Faces> all;
  for (const auto& [index, ignored] : sortedBlocks(map)) {
    const BlockStates* const block = reader.find(index);
    if (!block || !block->any_occupied) continue;
    const Surroundings around(reader, index);
    const Eigen::Vector3d corner =
        geometry.blockCentre(index) - origin - Eigen::Vector3d::Constant(0.5 * kBlockEdge * resolution);
    BlockFaces added(corner, resolution);
    for (int offset = 0; offset < kBlockVoxels; ++offset) {
      const int x = offset % kBlockEdge, y = offset / kBlockEdge % kBlockEdge,
                z = offset / kBlockEdge / kBlockEdge;
      if (!Surroundings::isOccupied(*block, x, y, z)) continue;
      const ClassId id = block->labels[static_cast<std::size_t>(offset)];
      for (std::size_t n = 0; n < std::size(kFaces); ++n) {
        if (around.isOpen(x, y, z, n)) added.add(kFaces[n], x, y, z, id, all[id]);
      }
    }
    std::uint64_t bytes = 0;
    for (const auto& [id, faces] : all) bytes += faces.bytes();
    if (bytes > most_bytes) throw std::length_error("the open faces of a map");
  }
  return all;
}

}  // namespace bki_mapping
