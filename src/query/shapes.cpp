#include "bki_mapping/query/queries.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "bki_mapping/core/named_parameter.h"
#include "query/voxel_rows.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kShapesPerJob = 64;

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
    refuse(" spans " + numberText(std::round(voxels)) + " voxels; split it, 100 million are the most");
  }
}

/// @param size what messages call the sizes. @param name called as name() for what they call the shape.
template <typename Name>
void checkSizes(const Eigen::Vector3d& sizes, const char* size, Name&& name) {
  if ((sizes.array() > 0.0).all() && sizes.allFinite()) return;
  throw std::invalid_argument(name() + " has a " + size + " that is not a number > 0; give metres > 0");
}

std::string theBox() {
  return "the box";
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

template <typename Name>
void read(const StateMap& states, const Eigen::AlignedBox3d& box, ContentReader& reader, Name&& name) {
  check(states.geometry(), box.min(), box.max(), name);
  const Eigen::Vector3d low = box.min() / states.geometry().resolution(),
                        high = box.max() / states.geometry().resolution();
  const VoxelRange x = overlapped(low.x(), high.x()), y = overlapped(low.y(), high.y()),
                   z = overlapped(low.z(), high.z());
  for (std::int32_t k = z.begin; k < z.end; ++k) {
    for (std::int32_t j = y.begin; j < y.end; ++j) reader.add(j, k, x);
  }
}

template <typename Name>
void read(const StateMap& states, const Sphere& sphere, ContentReader& reader, Name&& name) {
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(sphere.radius);
  checkSizes(reach, "radius", name);
  check(states.geometry(), sphere.centre - reach, sphere.centre + reach, name);
  const double resolution = states.geometry().resolution();
  forEachRow(sphere.centre / resolution, sphere.radius / resolution,
             [&](std::int32_t y, std::int32_t z, VoxelRange row) { reader.add(y, z, row); });
}

template <typename Shape>
SpaceContent contentOfOne(const StateMap& states, const Shape& shape, std::string (*name)()) {
  ContentReader reader(states);
  read(states, shape, reader, name);
  return reader.content();
}

/// @param shapes what messages call all of them. @param at returns a shape by its number.
/// @param name called as name(n) for what messages call it.
template <typename At, typename Name>
void readMany(const StateMap& states, std::size_t count, const char* shapes, At&& at, Name&& name,
              Span<SpaceContent> contents) {
  if (contents.size() != count) {
    throw std::invalid_argument("there are " + std::to_string(count) + " " + shapes + " and room for " +
                                std::to_string(contents.size()) + " contents; give as many contents as " +
                                shapes);
  }
  states.parallelFor((count + kShapesPerJob - 1) / kShapesPerJob, [&](std::size_t job) {
    ContentReader reader(states);
    const std::size_t end = std::min(count, (job + 1) * kShapesPerJob);
    for (std::size_t n = job * kShapesPerJob; n < end; ++n) {
      reader.clear();
      read(states, at(n), reader, [&name, n] { return name(n); });
      contents[n] = reader.content();
    }
  });
}

}  // namespace

std::optional<ClassId> SpaceContent::worst(Span<const ClassId> order) const {
  const auto found =
      std::find_if(order.begin(), order.end(), [&](ClassId id) { return classes.contains(id); });
  if (found == order.end()) return std::nullopt;
  return *found;
}

SpaceContent contentOf(const StateMap& states, const Eigen::AlignedBox3d& box) {
  return contentOfOne(states, box, theBox);
}

SpaceContent contentOf(const StateMap& states, const Sphere& sphere) {
  return contentOfOne(states, sphere, [] { return std::string("the sphere"); });
}

SpaceContent contentOf(const StateMap& states, const OrientedBox& box) {
  checkSizes(box.half_extents, "half extent", theBox);
  return contentOfOne(states, box, theBox);
}

void contentsOf(const StateMap& states, Span<const Eigen::AlignedBox3d> boxes, Span<SpaceContent> contents) {
  readMany(
      states, boxes.size(), "boxes", [&](std::size_t n) { return boxes[n]; },
      [](std::size_t n) { return "box " + std::to_string(n); }, contents);
}

void contentsOf(const StateMap& states, Span<const Sphere> spheres, Span<SpaceContent> contents) {
  readMany(
      states, spheres.size(), "spheres", [&](std::size_t n) { return spheres[n]; },
      [](std::size_t n) { return "sphere " + std::to_string(n); }, contents);
}

void contentsAlong(const StateMap& states, const OrientedBox& box,
                   Span<const Eigen::Isometry3d> T_map_vehicle, Span<SpaceContent> contents) {
  checkSizes(box.half_extents, "half extent", theBox);
  const auto there = [&](std::size_t n) {
    return OrientedBox{T_map_vehicle[n] * box.T_map_box, box.half_extents};
  };
  readMany(
      states, T_map_vehicle.size(), "poses", there,
      [](std::size_t n) { return "the box at pose " + std::to_string(n); }, contents);
}

}  // namespace bki_mapping
