#include "bki_mapping/query/shapes.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "query/voxel_rows.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kPosesPerJob = 64;

/// @param name called as name() for what the message calls the shape. @param low, high its corners [m].
template <typename Name>
void check(const GridGeometry& geometry, const Eigen::Vector3d& low, const Eigen::Vector3d& high,
           Name&& name) {
  const auto refuse = [&](const std::string& why) { throw std::invalid_argument(name() + why); };
  if (!low.allFinite() || !high.allFinite()) {
    refuse(" has a coordinate or size that is not finite; give finite ones");
  }
  if ((low.array() > high.array()).any()) refuse(" is inside out or empty; give sizes > 0 and min below max");
  if (!geometry.contains(low) || !geometry.contains(high)) {
    refuse(" reaches beyond the map's grid; cut it to where the map is");
  }
  const double voxels = ((high - low).array() / geometry.resolution() + 1.0).prod();
  if (voxels > kMostShapeVoxels) {
    refuse(" spans " + std::to_string(voxels) + " voxels; split it, 100 million are the most");
  }
}

void checkSizes(const Eigen::Vector3d& half_extents, const char* name) {
  if (!((half_extents.array() > 0.0).all() && half_extents.allFinite())) {
    throw std::invalid_argument(std::string(name) +
                                " has a half extent that is not a number > 0; give metres > 0");
  }
}

class ContentReader {
 public:
  explicit ContentReader(const StateMap& states) : reader_(states) {}

  void add(std::int32_t y, std::int32_t z, VoxelRange row) {
    constexpr std::int32_t kMask = kBlockEdge - 1;
    for (std::int32_t x = row.begin; x < row.end;) {
      const BlockIndex index = GridGeometry::blockOf({{x, y, z}});
      const std::int32_t end = std::min(row.end, (index.x + 1) * kBlockEdge);
      const auto length = static_cast<std::size_t>(end - x);
      const BlockStates* const block = reader_.find(index);
      if (block) {
        const auto layer = static_cast<std::size_t>(z & kMask);
        const int shift = kBlockEdge * (y & kMask) + (x & kMask);
        const std::uint64_t voxels = ((std::uint64_t{1} << length) - 1) << shift;
        add(*block, layer, voxels);
      } else {
        content_.unknown += length;
      }
      x = end;
    }
  }
  const SpaceContent& content() const { return content_; }
  void clear() { content_ = {}; }

 private:
  /// @param voxels of the layer, as in BlockStates::Layer.
  void add(const BlockStates& block, std::size_t layer, std::uint64_t voxels) {
    const auto count = [](std::uint64_t bits) {
      return static_cast<std::size_t>(__builtin_popcountll(bits));
    };
    const std::uint64_t free = block.layers[layer].free & voxels;
    std::uint64_t occupied = block.layers[layer].occupied & voxels;
    content_.free += count(free);
    content_.occupied += count(occupied);
    content_.unknown += count(voxels) - count(free) - count(occupied);
    for (; occupied != 0; occupied &= occupied - 1) {
      content_.classes.insert(block.labels[64 * layer + static_cast<std::size_t>(__builtin_ctzll(occupied))]);
    }
  }

  BlockReader reader_;
  SpaceContent content_;
};

template <typename Name>
void read(const StateMap& states, const OrientedBox& box, ContentReader& reader, Name&& name) {
  const double resolution = states.geometry().resolution();
  const Eigen::Vector3d centre = box.T_map_box.translation();
  const Eigen::Matrix3d rotation = box.T_map_box.linear();
  if (!rotation.allFinite() || !rotation.isUnitary(1e-6)) {
    throw std::invalid_argument(name() + " is not rotated by a rotation; give a pose without scale or shear");
  }
  const OrientedBoxRows rows(centre / resolution, rotation, box.half_extents / resolution);
  check(states.geometry(), centre - rows.extents() * resolution, centre + rows.extents() * resolution, name);
  rows.forEach([&](std::int32_t y, std::int32_t z, VoxelRange row) { reader.add(y, z, row); });
}

}  // namespace

std::optional<ClassId> SpaceContent::worst(Span<const ClassId> order) const {
  const auto found =
      std::find_if(order.begin(), order.end(), [&](ClassId id) { return classes.contains(id); });
  if (found == order.end()) return std::nullopt;
  return *found;
}

SpaceContent contentOf(const StateMap& states, const Eigen::AlignedBox3d& box) {
  check(states.geometry(), box.min(), box.max(), [] { return std::string("the box"); });
  const Eigen::Vector3d low = box.min() / states.geometry().resolution(),
                        high = box.max() / states.geometry().resolution();
  const VoxelRange x = overlapped(low.x(), high.x()), y = overlapped(low.y(), high.y()),
                   z = overlapped(low.z(), high.z());
  ContentReader reader(states);
  for (std::int32_t k = z.begin; k < z.end; ++k) {
    for (std::int32_t j = y.begin; j < y.end; ++j) reader.add(j, k, x);
  }
  return reader.content();
}

SpaceContent contentOf(const StateMap& states, const Sphere& sphere) {
  checkSizes(Eigen::Vector3d::Constant(sphere.radius), "the sphere");
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(sphere.radius);
  check(states.geometry(), sphere.centre - reach, sphere.centre + reach,
        [] { return std::string("the sphere"); });
  const double resolution = states.geometry().resolution();
  ContentReader reader(states);
  forEachRow(sphere.centre / resolution, sphere.radius / resolution,
             [&](std::int32_t y, std::int32_t z, VoxelRange row) { reader.add(y, z, row); });
  return reader.content();
}

SpaceContent contentOf(const StateMap& states, const OrientedBox& box) {
  checkSizes(box.half_extents, "the box");
  ContentReader reader(states);
  read(states, box, reader, [] { return std::string("the box"); });
  return reader.content();
}

void contentsAlong(const StateMap& states, const OrientedBox& box,
                   Span<const Eigen::Isometry3d> T_map_vehicle, Span<SpaceContent> contents) {
  checkSizes(box.half_extents, "the box");
  if (contents.size() != T_map_vehicle.size()) {
    throw std::invalid_argument("there are " + std::to_string(T_map_vehicle.size()) + " poses and room for " +
                                std::to_string(contents.size()) +
                                " contents; give as many contents as poses");
  }
  states.parallelFor((contents.size() + kPosesPerJob - 1) / kPosesPerJob, [&](std::size_t job) {
    ContentReader reader(states);
    const std::size_t end = std::min(contents.size(), (job + 1) * kPosesPerJob);
    for (std::size_t n = job * kPosesPerJob; n < end; ++n) {
      const OrientedBox there = {T_map_vehicle[n] * box.T_map_box, box.half_extents};
      reader.clear();
      read(states, there, reader, [n] { return "the box at pose " + std::to_string(n); });
      contents[n] = reader.content();
    }
  });
}

}  // namespace bki_mapping
