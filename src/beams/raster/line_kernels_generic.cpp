#include "beams/raster/line_kernels.h"
#include "kernel/kernel_table.h"
#include "kernel/sparse_kernel.h"
#include "simd/vec_generic.h"

#include "beams/raster/line_kernels_inl.h"

namespace bki_mapping {

const LineKernels& lineKernelsGeneric() {
  static const LineKernels kernels = {"generic", setUpLines, traceBeams, weigh, VecKernel::kScale};
  return kernels;
}

}  // namespace bki_mapping
