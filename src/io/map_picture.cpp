#include "io/map_picture.h"

#include <png.h>

#include <algorithm>
#include <stdexcept>

#include "core/atomic_file.h"

namespace bki_mapping {
namespace {

constexpr Color kBackground = {255, 255, 255};
/// Brightness of the farthest voxels, as a fraction of that of the nearest.
constexpr double kFarthest = 0.45;

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
    : view_(view), along_y_(high.y - low.y > high.x - low.x) {
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
    const Seen seen = see(GridGeometry::voxelOf(index, offset));
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

Picture MapPicture::draw(const ClassTable& classes) const {
  Picture picture{std::max(1, width_ * pixels_), std::max(1, height_ * pixels_), {}};
  picture.pixels.assign(static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height),
                        kBackground);
  const double depth = std::max(1, last_.nearness - first_.nearness);
  for (int y = 0; y < height_ * pixels_; ++y) {
    for (int x = 0; x < width_ * pixels_; ++x) {
      const Cell& cell = cells_[static_cast<std::size_t>(y / pixels_ * width_ + x / pixels_)];
      Color& pixel = picture.pixels[static_cast<std::size_t>((picture.height - 1 - y) * picture.width + x)];
      if (cell.nearness == kNothing) {
        if (cell.free) pixel = kFreeColor;
        continue;
      }
      const double near = (cell.nearness - first_.nearness) / depth;
      pixel = darkened(semanticColor(VoxelState::kOccupied, cell.label, classes),
                       kFarthest + (1.0 - kFarthest) * near);
    }
  }
  return picture;
}

}  // namespace bki_mapping
