#include "query/distance_kernels.h"

#include "simd/vec_avx2.h"

#include "query/distance_kernels_inl.h"

#include "simd/end_region.h"

namespace bki_mapping {

const DistanceKernels& distanceKernelsAvx2() {
  static const DistanceKernels kernels = {"avx2", sweepColumns, searchRow, searchColumns};
  return kernels;
}

}  // namespace bki_mapping
