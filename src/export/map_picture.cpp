#include "export/map_picture.h"

#include <png.h>

#include <algorithm>
#include <stdexcept>

#include "core/atomic_file.h"
#include "export/display_colors.h"

namespace bki_mapping {
namespace {

constexpr Color kBackground = {255, 255, 255};
/// Cells around a cell that shade it, in each direction.
constexpr int kReach = 2;
/// By how much each of them must be nearer to the viewer to shade it fully [voxels].
constexpr double kFullRise = 8.0;
/// Brightness of a cell that all others shade fully.
constexpr double kDarkest = 0.7;

Color darkened(const Color& color, double brightness) {
  Color darker;
  for (std::size_t i = 0; i < color.size(); ++i) darker[i] = static_cast<std::uint8_t>(brightness * color[i]);
  return darker;
}

}  // namespace

void writePng(const std::string& path, const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = PNG_FORMAT_RGB;
  const auto fail = [&] {
    return std::runtime_error("the picture " + path + " cannot be made: " + image.message);
  };
  std::string bytes(PNG_IMAGE_PNG_SIZE_MAX(image), '\0');
  png_alloc_size_t size = bytes.size();
  if (!png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.pixels.data(), 0, nullptr))
    throw fail();
  bytes.resize(size);
  AtomicFile file(path);
  file.write(bytes);
  file.commit();
}

MapPicture::MapPicture(View view, const GridIndex& low, const GridIndex& high)
    : view_(view), along_y_(high.y - low.y > high.x - low.x), highest_(high.z) {
  if (low.x > high.x) return;
  const Seen a = see(low), b = see(high);
  first_ = {std::min(a.right, b.right), std::min(a.up, b.up), std::min(a.nearness, b.nearness)};
  last_ = {std::max(a.right, b.right), std::max(a.up, b.up), std::max(a.nearness, b.nearness)};
  const int extent = std::max(last_.right - first_.right, last_.up - first_.up) + 1;
  voxels_ = (extent - 1) / kMostPixels + 1;
  pixels_ = std::max(1, kMostPixels / extent);
  width_ = (last_.right - first_.right) / voxels_ + 1;
  height_ = (last_.up - first_.up) / voxels_ + 1;
  cells_.resize(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
}

MapPicture::Seen MapPicture::see(const GridIndex& voxel) const {
  if (view_ == View::kTop) return {voxel.x, voxel.y, voxel.z};
  if (along_y_) return {voxel.y, voxel.z, voxel.x};
  return {voxel.x, voxel.z, -voxel.y};
}

void MapPicture::add(const BlockIndex& index, const BlockView& view) {
  for (int offset = 0; offset < kBlockVoxels; ++offset) {
    const auto v = static_cast<std::size_t>(offset);
    const bool occupied = view.state[v] == VoxelState::kOccupied;
    if (!occupied && view.state[v] != VoxelState::kFree) continue;
    const GridIndex voxel = GridGeometry::voxelOf(index, offset);
    if (voxel.z > highest_) continue;
    const Seen seen = see(voxel);
    const auto column = static_cast<std::size_t>((seen.right - first_.right) / voxels_);
    const auto row = static_cast<std::size_t>((seen.up - first_.up) / voxels_);
    Cell& cell = cells_.at(row * static_cast<std::size_t>(width_) + column);
    if (!occupied) {
      cell.free = true;
    } else if (seen.nearness > cell.nearness ||
               (seen.nearness == cell.nearness && view.label[v] < cell.label)) {
      cell.nearness = seen.nearness;
      cell.label = view.label[v];
    }
  }
}

const MapPicture::Cell& MapPicture::cellAt(int column, int row) const {
  return cells_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_) +
                static_cast<std::size_t>(column)];
}

// Only what is near shades a cell, so that a floor keeps its colour below a ceiling with gaps, and a street
// below a single voxel high above it.
double MapPicture::brightness(int column, int row) const {
  const int own = cellAt(column, row).nearness;
  double shade = 0.0;
  int around = 0;
  for (int y = std::max(0, row - kReach); y <= std::min(height_ - 1, row + kReach); ++y) {
    for (int x = std::max(0, column - kReach); x <= std::min(width_ - 1, column + kReach); ++x) {
      const int other = cellAt(x, y).nearness;
      if (other == kNothing || (x == column && y == row)) continue;
      ++around;
      shade += std::clamp((other - own) / kFullRise, 0.0, 1.0);
    }
  }
  return around == 0 ? 1.0 : 1.0 - (1.0 - kDarkest) * shade / around;
}

Picture MapPicture::draw(const ClassTable& classes) const {
  const ClassTable shown = displayTable(classes);
  Picture picture{std::max(1, width_ * pixels_), std::max(1, height_ * pixels_), {}};
  picture.pixels.assign(static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height),
                        kBackground);
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      const Cell& cell = cellAt(column, row);
      if (cell.nearness == kNothing && !cell.free) continue;
      const Color color =
          cell.nearness == kNothing
              ? kFreeColor
              : darkened(semanticColor(VoxelState::kOccupied, cell.label, shown), brightness(column, row));
      for (int y = row * pixels_; y < (row + 1) * pixels_; ++y) {
        const auto first = picture.pixels.begin() + std::ptrdiff_t{picture.height - 1 - y} * picture.width +
                           column * pixels_;
        std::fill(first, first + pixels_, color);
      }
    }
  }
  return picture;
}

}  // namespace bki_mapping
