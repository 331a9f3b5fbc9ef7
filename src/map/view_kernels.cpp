#include "map/view_kernels.h"

#include "simd/instruction_sets.h"

namespace bki_mapping {

const ViewKernels& viewKernelsGeneric();
const ViewKernels& viewKernelsAvx2();
const ViewKernels& viewKernelsAvx512();

const ViewKernels& viewKernelsFor(const std::string& instruction_set) {
  const KernelsBySet<ViewKernels> kernels = {viewKernelsGeneric(), viewKernelsAvx2(), viewKernelsAvx512()};
  return kernels.choose(instruction_set);
}

}  // namespace bki_mapping
