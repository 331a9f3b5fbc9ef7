#include "map/view_kernels.h"

#include "simd/vec_avx512.h"

#include "map/view_kernels_inl.h"

#include "simd/end_region.h"

namespace bki_mapping {

const ViewKernels& viewKernelsAvx512() {
  static const ViewKernels kernels = {"avx512", readPlanes<false, false>, readPlanes<true, false>,
                                      readPlanes<true, true>, readVotes};
  return kernels;
}

}  // namespace bki_mapping
