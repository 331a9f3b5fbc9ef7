#include "map/view_kernels.h"

#include "simd/vec_generic.h"

#include "map/view_kernels_inl.h"

namespace bki_mapping {

const ViewKernels& viewKernelsGeneric() {
  static const ViewKernels kernels = {"generic", readPlanes<false, false>, readPlanes<true, false>,
                                      readPlanes<true, true>, readVotes};
  return kernels;
}

}  // namespace bki_mapping
