/// @file Pictures of maps from above and from the side.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/rules/voxel_state.h"
#include "export/display_colors.h"

namespace bki_mapping {

struct Picture {
  int width = 0, height = 0;
  std::vector<Color> pixels;  ///< rows from the top, each from the left
};

/// Writes a picture as a PNG file by AtomicFile. @throws std::runtime_error if it cannot be written.
void writePng(const std::string& path, const Picture& picture);

/// Collects the voxels of a map that a viewer far away sees, block by block and in any order. Where no voxel
/// is occupied, free ones are shown. The memory depends on the size of the picture, not on the map.
class MapPicture {
 public:
  enum class View {
    kTop,     ///< from above, y up
    kProfile  ///< along the shorter of the two horizontal sides of the map, z up
  };
  /// Longest edge of a picture [pixels]. Larger maps are reduced to it, smaller ones enlarged.
  static constexpr int kMostPixels = 2048;

  /// @param low, high the first and last voxel that is shown; without voxels, low.x > high.x. What lies above
  /// high.z is left out; no voxel may lie outside of the box otherwise.
  MapPicture(View view, const GridIndex& low, const GridIndex& high);

  void add(const BlockIndex& index, const BlockView& view);
  /// Occupied voxels in the colours of displayTable, darker beside voxels that are nearer to the viewer; free
  /// space light blue; the rest white.
  Picture draw(const ClassTable& classes) const;
  /// Edge of a pixel [voxels].
  double voxelsPerPixel() const { return static_cast<double>(voxels_) / pixels_; }

 private:
  static constexpr int kNothing = std::numeric_limits<int>::min();
  /// The voxel that a point of the picture shows: the one nearest to the viewer.
  struct Cell {
    int nearness = kNothing;  ///< coordinate towards the viewer; kNothing: no occupied voxel
    ClassId label = kFreeClass;
    bool free = false;
  };
  /// A voxel as the viewer sees it.
  struct Seen {
    int right, up, nearness;
  };
  Seen see(const GridIndex& voxel) const;
  const Cell& cellAt(int column, int row) const;
  /// The brightness of an occupied cell, 0.7 to 1.
  double brightness(int column, int row) const;

  View view_;
  bool along_y_;                 ///< in a profile, whether the map extends along y
  int highest_;                  ///< z of the highest voxels that are shown
  Seen first_{}, last_{};        ///< least and greatest coordinates
  int voxels_ = 1, pixels_ = 1;  ///< `voxels_` adjacent voxels take `pixels_` pixels; one of the two is 1
  int width_ = 0, height_ = 0;   ///< [cells]
  std::vector<Cell> cells_;      ///< rows from below
};

}  // namespace bki_mapping
