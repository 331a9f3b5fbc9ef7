#include "update/sum_kernels.h"

#include "simd/vec_avx512.h"

#include "update/sum_kernels_inl.h"

#include "simd/end_region.h"

namespace bki_mapping {

const SumKernels& sumKernelsAvx512() {
  static const SumKernels kernels = {"avx512",       addSums<false>, addSums<true>, addUnits<false>,
                                     addUnits<true>, limitSums,      findSums};
  return kernels;
}

}  // namespace bki_mapping
