/// @file How beams' surroundings are cut into slices of voxels, which beams are traced through.
#pragma once

namespace bki_mapping {

/// A beam runs along one axis most, its main axis. About it, voxels stand in columns along the height axis,
/// and columns side by side along the side axis.
constexpr int kSideAxis[3] = {1, 0, 1}, kHeightAxis[3] = {2, 2, 0};

/// Straight slices stand across the main axis, and hold columns 1 voxel apart. In skew slices 2 main + skew
/// side is the same for all voxels: their columns are sqrt(5) voxels apart, so that a short kernel reaches
/// but one of them. A slice's columns are counted by their side in straight slices, by main in skew ones.
struct BeamSlicing {
  static constexpr int kCount = 9;

  int axis;  ///< the main axis
  int skew;  ///< 1 or -1, or 0: straight

  constexpr int number() const { return axis + 3 * (skew == 0 ? 0 : skew > 0 ? 1 : 2); }
  static constexpr BeamSlicing of(int number) { return {number % 3, number < 3 ? 0 : number < 6 ? 1 : -1}; }
};

}  // namespace bki_mapping
