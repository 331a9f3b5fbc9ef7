#include "kernel/kernel_table.h"
#include "kernel/sparse_kernel.h"
#include "points/point_kernels.h"
#include "simd/vec_avx512.h"

#include "points/point_kernels_inl.h"
#include "points/tile_kernels_inl.h"

#include "simd/end_region.h"

namespace bki_mapping {

const PointKernels& pointKernelsAvx512() {
  static const PointKernels kernels = {"avx512", sumPoints, locatePoints, locateCells, reachBlocks};
  return kernels;
}

}  // namespace bki_mapping
