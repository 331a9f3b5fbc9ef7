#include "query/distance_kernels.h"

#include "simd/vec_generic.h"

#include "query/distance_kernels_inl.h"

namespace bki_mapping {

const DistanceKernels& distanceKernelsGeneric() {
  static const DistanceKernels kernels = {"generic", sweepColumns, searchRow, searchColumns};
  return kernels;
}

}  // namespace bki_mapping
