#include "query/distance_kernels.h"

#include "simd/vec_avx512.h"

#include "query/distance_kernels_inl.h"

#include "simd/end_region.h"

namespace bki_mapping {

const DistanceKernels& distanceKernelsAvx512() {
  static const DistanceKernels kernels = {"avx512", sweepColumns, searchRow, searchColumns};
  return kernels;
}

}  // namespace bki_mapping
