#include "update/sum_kernels.h"

#include "simd/vec_generic.h"

#include "update/sum_kernels_inl.h"

namespace bki_mapping {

const SumKernels& sumKernelsGeneric() {
  static const SumKernels kernels = {"generic",      addSums<false>, addSums<true>, addUnits<false>,
                                     addUnits<true>, limitSums,      findSums};
  return kernels;
}

}  // namespace bki_mapping
