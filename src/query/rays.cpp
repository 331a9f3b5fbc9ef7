#include "bki_mapping/query/queries.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "query/ray_walk.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kRaysPerJob = 512;  ///< some 500 us
constexpr int kBlockShift = 3, kRegionShift = 6;
static_assert(1 << kBlockShift == kBlockEdge && 1 << kRegionShift == kBlockEdge * Region::kEdge);

/// @param name called as name() for what the message calls the ray.
template <typename Name>
void check(const GridGeometry& geometry, const Ray& ray, Name&& name) {
  const auto refuse = [&](const char* why) { throw std::invalid_argument(name() + why); };
  if (!ray.origin.allFinite() || !ray.direction.allFinite()) {
    refuse(" has a coordinate that is not finite; remove such rays");
  }
  if (!geometry.contains(ray.origin)) refuse(" starts beyond the map's grid; start it within the map");
  if (!(ray.direction.cwiseAbs().maxCoeff() > 0.0))
    refuse(" has the direction 0; give one of any length > 0");
  if (!(ray.length >= 0.0)) refuse(" has a negative length or none; give 0 m or more");
}

/// The direction with its largest coordinate between 1/2 and 1; exact.
Eigen::Vector3d scaled(const Eigen::Vector3d& direction) {
  int exponent;
  std::frexp(direction.cwiseAbs().maxCoeff(), &exponent);
  return direction.unaryExpr([exponent](double x) { return std::ldexp(x, -exponent); });
}

/// Lengths along a ray, in units of its direction.
struct Range {
  double begin, end;
};

/// Where a ray lies in the box of all blocks, or near it: rounding lets some more of the ray in.
Range within(const GridBounds& blocks, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  constexpr double kMargin = 1.0;
  const Eigen::Vector3d low = Eigen::Vector3d(blocks.min.x, blocks.min.y, blocks.min.z) * kBlockEdge,
                        high = Eigen::Vector3d(blocks.max.x + 1, blocks.max.y + 1, blocks.max.z + 1) *
                               kBlockEdge;
  Range range = {0.0, std::numeric_limits<double>::infinity()};
  for (Eigen::Index a = 0; a < 3; ++a) {
    const double to_low = low[a] - kMargin - origin[a], to_high = high[a] + kMargin - origin[a];
    if (direction[a] == 0.0) {
      if (to_low > 0.0 || to_high < 0.0) range.end = -1.0;
      continue;
    }
    const auto [first, last] = std::minmax({to_low / direction[a], to_high / direction[a]});
    range.begin = std::max(range.begin, first);
    range.end = std::min(range.end, last);
  }
  return range;
}

class RayCaster {
 public:
  RayCaster(const StateMap& states, const RayStops& stops)
      : states_(states), stops_(stops), stops_at_occupied_(!stops.classes.empty()), reader_(states) {}

  /// @param ray checked.
  RayHit cast(const Ray& ray) {
    const double resolution = states_.geometry().resolution();
    const Eigen::Vector3d origin = ray.origin / resolution, direction = scaled(ray.direction);
    const double unit = resolution * direction.norm();
    const Range inside = within(states_.blockBounds(), origin, direction);
    end_ = std::min(ray.length / unit, inside.end);
    seeks_unknown_ = true;
    hit_ = {};
    RayWalk walk(origin, direction);
    if (inside.begin > 0.0) {  // outside of all blocks
      meetUnknown(walk);
      if (inside.begin < end_) walk.skipTo(inside.begin);
    }
    do {
      walkThroughBlock(walk);
    } while (hit_.end == RayEnd::kNothing && walk.entered() < end_);
    hit_.length = hit_.end == RayEnd::kNothing ? ray.length : hit_.length * unit;
    hit_.first_unknown *= unit;
    return hit_;
  }

 private:
  /// Moves to the end of the present block, or of the present region if the map has no block there. Stays in
  /// the voxel at which the ray stops.
  void walkThroughBlock(RayWalk& walk) {
    const BlockIndex index = GridGeometry::blockOf(walk.voxel());
    const StateMap::RegionStates* const region = reader_.region(index);
    const StateMap::RegionStates::Glance glance =
        region ? region->glance(states_, index) : StateMap::RegionStates::Glance();
    if (!glance.block) {
      meetUnknown(walk);
      if (hit_.end == RayEnd::kNothing) walk.leave(region ? kBlockShift : kRegionShift);
      return;
    }
    RayWalk beyond = walk;
    const VoxelIndex last = beyond.leave(kBlockShift);
    const bool may_hit = glance.any_occupied && stops_at_occupied_,
               may_be_unknown = seeks_unknown_ && !glance.all_free;
    if (!(may_hit || may_be_unknown) || !mayStop(*glance.block, walk.voxel(), last)) {
      walk = beyond;
      return;
    }
    do {
      meetVoxel(walk, *glance.block);
      if (hit_.end != RayEnd::kNothing) return;
    } while (walk.step(kBlockShift) && walk.entered() < end_);
  }

  /// Whether anything can happen to the ray in the box between two voxels of a block.
  bool mayStop(const BlockStates& block, const VoxelIndex& one, const VoxelIndex& other) const {
    const auto ofBoth = [](std::int32_t a, std::int32_t b) {
      const auto m = static_cast<unsigned>(a) % kBlockEdge, n = static_cast<unsigned>(b) % kBlockEdge;
      return std::make_pair(std::min(m, n), std::max(m, n));
    };
    const auto [low_x, high_x] = ofBoth(one.x, other.x);
    const auto [low_y, high_y] = ofBoth(one.y, other.y);
    const auto [low_z, high_z] = ofBoth(one.z, other.z);
    constexpr std::uint64_t kAll = ~std::uint64_t{0}, kColumn = kAll / 0xff;
    const std::uint64_t row = (2u << high_x) - (1u << low_x);
    const std::uint64_t box = row * kColumn & kAll << kBlockEdge * low_y & kAll >> kBlockEdge * (7 - high_y);
    std::uint64_t found = 0;
    for (unsigned z = low_z; z <= high_z; ++z) {
      const BlockStates::Layer& layer = block.layers[z];
      found |= seeks_unknown_ ? ~layer.free : layer.occupied;
    }
    return (found & box) != 0;
  }

  void meetVoxel(const RayWalk& walk, const BlockStates& block) {
    const VoxelIndex voxel = walk.voxel();
    const int offset = GridGeometry::offsetInBlock(voxel), bit = offset % 64;
    const BlockStates::Layer& layer = block.layers[static_cast<std::size_t>(offset / 64)];
    if (layer.occupied >> bit & 1) {
      const ClassId label = block.labels[static_cast<std::size_t>(offset)];
      if (!stops_.classes.contains(label)) return;
      hit_.end = RayEnd::kOccupied;
      hit_.label = label;
      hit_.voxel = voxel;
      hit_.length = walk.entered();
    } else if (seeks_unknown_ && !(layer.free >> bit & 1)) {
      meetUnknown(walk);
    }
  }

  void meetUnknown(const RayWalk& walk) {
    if (!seeks_unknown_) return;
    seeks_unknown_ = false;
    hit_.first_unknown = walk.entered();
    if (!stops_.unknown) return;
    hit_.end = RayEnd::kUnknown;
    hit_.voxel = walk.voxel();
    hit_.length = walk.entered();
  }

  const StateMap& states_;
  const RayStops& stops_;
  bool stops_at_occupied_;
  BlockReader reader_;
  // Of the present ray, lengths in units of its direction:
  double end_ = 0.0;
  bool seeks_unknown_ = true;  ///< whether it has met no unknown voxel yet
  RayHit hit_;
};

}  // namespace

RayHit castRay(const StateMap& states, const Ray& ray, const RayStops& stops) {
  check(states.geometry(), ray, [] { return std::string("the ray"); });
  return RayCaster(states, stops).cast(ray);
}

void castRays(const StateMap& states, Span<const Ray> rays, const RayStops& stops, Span<RayHit> hits) {
  if (hits.size() != rays.size()) {
    throw std::invalid_argument("there are " + std::to_string(rays.size()) + " rays and room for " +
                                std::to_string(hits.size()) + " hits; give as many hits as rays");
  }
  for (std::size_t n = 0; n < rays.size(); ++n) {
    check(states.geometry(), rays[n], [&] { return "ray " + std::to_string(n); });
  }
  states.parallelFor((rays.size() + kRaysPerJob - 1) / kRaysPerJob, [&](std::size_t job) {
    RayCaster caster(states, stops);
    const std::size_t end = std::min(rays.size(), (job + 1) * kRaysPerJob);
    for (std::size_t n = job * kRaysPerJob; n < end; ++n) hits[n] = caster.cast(rays[n]);
  });
}

}  // namespace bki_mapping
