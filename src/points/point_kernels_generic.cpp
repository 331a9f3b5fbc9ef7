#include "kernel/kernel_table.h"
#include "kernel/sparse_kernel.h"
#include "points/point_kernels.h"
#include "simd/vec_generic.h"

#include "points/point_kernels_inl.h"
#include "points/tile_kernels_inl.h"

namespace bki_mapping {

const PointKernels& pointKernelsGeneric() {
  static const PointKernels kernels = {"generic", sumPoints, locatePoints, locateCells, reachBlocks};
  return kernels;
}

}  // namespace bki_mapping
