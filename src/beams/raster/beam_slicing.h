/// @file The slices of voxels through which beams are swept.
#pragma once

namespace bki_mapping {

/// A slice is the set of voxels in one position of a sweep plane: the plane moves along the beam, and in each
/// slice the line of the beam has one position. The main axis is that along which the beam runs most; columns
/// of voxels lie along the height axis, and columns are counted along the side axis.
constexpr int kSideAxis[3] = {1, 0, 1}, kHeightAxis[3] = {2, 2, 0};

/// Straight slices are perpendicular to the main axis; their columns are 1 voxel apart. Sheared slices stand
/// oblique, as in shear-warp volume rendering: 2 main + shear side is the same for all voxels of a slice.
/// Their columns are sqrt(5) voxels apart, so that a narrow kernel reaches only one of them. Columns of
/// straight slices are counted by their side, columns of sheared slices by their main coordinate.
struct BeamSlicing {
  static constexpr int kCount = 9;

  int axis;   ///< the main axis
  int shear;  ///< 1 or -1, or 0: straight

  constexpr int number() const { return axis + 3 * (shear == 0 ? 0 : shear > 0 ? 1 : 2); }
  static constexpr BeamSlicing of(int number) { return {number % 3, number < 3 ? 0 : number < 6 ? 1 : -1}; }
};

}  // namespace bki_mapping
