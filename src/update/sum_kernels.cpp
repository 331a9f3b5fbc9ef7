#include "update/sum_kernels.h"

#include "simd/instruction_sets.h"

namespace bki_mapping {

const SumKernels& sumKernelsGeneric();
const SumKernels& sumKernelsAvx2();
const SumKernels& sumKernelsAvx512();

const SumKernels& sumKernelsFor(const std::string& instruction_set) {
  const KernelsBySet<SumKernels> kernels = {sumKernelsGeneric(), sumKernelsAvx2(), sumKernelsAvx512()};
  return kernels.choose(instruction_set);
}

}  // namespace bki_mapping
