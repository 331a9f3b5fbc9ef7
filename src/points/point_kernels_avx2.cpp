#include "kernel/kernel_table.h"
#include "kernel/sparse_kernel.h"
#include "points/point_kernels.h"
#include "simd/vec_avx2.h"

#include "points/point_kernels_inl.h"
#include "points/tile_kernels_inl.h"

#include "simd/end_region.h"

namespace bki_mapping {

const PointKernels& pointKernelsAvx2() {
  static const PointKernels kernels = {"avx2", sumPoints, locatePoints, locateCells, reachBlocks};
  return kernels;
}

}  // namespace bki_mapping
