#include "map/view_kernels.h"

#include "simd/vec_avx2.h"

#include "map/view_kernels_inl.h"

#include "simd/end_region.h"

namespace bki_mapping {

const ViewKernels& viewKernelsAvx2() {
  static const ViewKernels kernels = {"avx2", readPlanes<false, false>, readPlanes<true, false>,
                                      readPlanes<true, true>, readVotes};
  return kernels;
}

}  // namespace bki_mapping
