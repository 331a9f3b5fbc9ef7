#include "beams/raster/line_kernels.h"
#include "kernel/kernel_table.h"
#include "kernel/sparse_kernel.h"
#include "simd/vec_avx512.h"

#include "beams/raster/line_kernels_inl.h"

#include "simd/end_region.h"

namespace bki_mapping {

const LineKernels& lineKernelsAvx512() {
  static const LineKernels kernels = {"avx512", setUpLines, traceBeams, weigh, VecKernel::kScale};
  return kernels;
}

}  // namespace bki_mapping
