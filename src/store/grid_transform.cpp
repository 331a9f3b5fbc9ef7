#include "store/grid_transform.h"

#include <cmath>
#include <stdexcept>

#include "core/pi.h"
#include "store/box_tiles.h"

namespace bki_mapping {
namespace {

/// Tolerance within which a number of voxels or quarter turns counts as whole: larger than the rounding of
/// decimal fractions of metres, and smaller than any shift that a user intends.
constexpr double kWholeTolerance = 1e-6;

bool isWhole(double number) {
  return std::abs(number - std::round(number)) < kWholeTolerance;
}

/// The bounding box of the images of a box's corners.
template <typename Map>
Eigen::AlignedBox3d boxAbout(const Eigen::AlignedBox3d& box, Map&& map) {
  Eigen::AlignedBox3d about;
  for (int corner = 0; corner < 8; ++corner) {
    about.extend(map(box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner))));
  }
  return about;
}

GridIndex tileAt(const Eigen::Vector3d& point) {
  const Eigen::Vector3i tile = (point / kTileEdge).array().floor().cast<int>();
  return {tile.x(), tile.y(), tile.z()};
}

Eigen::AlignedBox3d boxOf(const GridIndex& tile) {
  const Eigen::Vector3d low = kTileEdge * Eigen::Vector3d(tile.x, tile.y, tile.z);
  return {low, low + Eigen::Vector3d::Constant(kTileEdge)};
}

}  // namespace

GridTransform::GridTransform(const MapPlacement& placement, double resolution)
    : resolution_(resolution), shift_(placement.translation / resolution) {
  const double quarters = placement.yaw / 90.0;
  if (!shift_.allFinite() || !std::isfinite(quarters)) {
    throw std::invalid_argument("the placement of a map is not finite; give finite metres and degrees");
  }
  exact_ = isWhole(quarters);
  for (const double number : {shift_.x(), shift_.y(), shift_.z()}) exact_ = exact_ && isWhole(number);
  if (exact_) {
    shift_ = shift_.array().round();
    constexpr double kCos[] = {1.0, 0.0, -1.0, 0.0}, kSin[] = {0.0, 1.0, 0.0, -1.0};
    const auto turn = static_cast<std::size_t>(std::fmod(std::fmod(std::round(quarters), 4.0) + 4.0, 4.0));
    cos_ = kCos[turn];
    sin_ = kSin[turn];
  } else {
    const double yaw = std::fmod(placement.yaw, 360.0) * kPi / 180.0;
    cos_ = std::cos(yaw);
    sin_ = std::sin(yaw);
  }
}

Eigen::Vector3d GridTransform::forward(const Eigen::Vector3d& p) const {
  return Eigen::Vector3d(cos_ * p.x() - sin_ * p.y(), sin_ * p.x() + cos_ * p.y(), p.z()) + shift_;
}

Eigen::Vector3d GridTransform::backward(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d p = point - shift_;
  return {cos_ * p.x() + sin_ * p.y(), cos_ * p.y() - sin_ * p.x(), p.z()};
}

VoxelIndex GridTransform::sourceOf(const VoxelIndex& target) const {
  // Exact for whole numbers: doubles represent halves of indices, and the factors are 0, 1 and -1.
  const Eigen::Vector3d centre = backward({target.x + 0.5, target.y + 0.5, target.z + 0.5});
  return {{floorToInt(centre.x()), floorToInt(centre.y()), floorToInt(centre.z())}};
}

TileRange GridTransform::sourceTiles(const GridIndex& target) const {
  const Eigen::AlignedBox3d tile = boxOf(target);
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5);  // from the face to the first centre
  const Eigen::AlignedBox3d centres(tile.min() + half, tile.max() - half);
  const Eigen::AlignedBox3d sources =
      boxAbout(centres, [this](const Eigen::Vector3d& p) { return backward(p); });
  return {tileAt(sources.min()), tileAt(sources.max())};
}

TileRange GridTransform::targetTiles(const GridIndex& source) const {
  const Eigen::AlignedBox3d targets =
      boxAbout(boxOf(source), [this](const Eigen::Vector3d& p) { return forward(p); });
  // Centres of whole voxels are half a voxel inside; others may be anywhere, and a rounding error outside.
  const Eigen::Vector3d inside = Eigen::Vector3d::Constant(exact_ ? 0.5 : -1e-3);
  const Eigen::AlignedBox3d centres(targets.min() + inside, targets.max() - inside);
  if (!(centres.min().array().abs() < GridGeometry::kMaxCoordinate).all() ||
      !(centres.max().array().abs() < GridGeometry::kMaxCoordinate).all()) {
    throw std::invalid_argument(
        "a placement moves a map too far from the origin of the frame; check its metres");
  }
  return {tileAt(centres.min()), tileAt(centres.max())};
}

Eigen::AlignedBox3d GridTransform::apply(const Eigen::AlignedBox3d& box) const {
  if (box.isEmpty()) return box;
  return boxAbout(box, [this](const Eigen::Vector3d& p) -> Eigen::Vector3d {
    Eigen::Vector3d voxels = p / resolution_;
    // A corner of voxels is rounded as GridGeometry rounds it, so that moving it back gives the same bits.
    const Eigen::Vector3d whole = voxels.array().round();
    if (exact_ && whole * resolution_ == p) voxels = whole;
    return forward(voxels) * resolution_;
  });
}

}  // namespace bki_mapping
