#include "beams/raster/line_kernels.h"

#include "simd/instruction_sets.h"

namespace bki_mapping {

const LineKernels& lineKernelsGeneric();
const LineKernels& lineKernelsAvx2();
const LineKernels& lineKernelsAvx512();

const LineKernels& lineKernelsFor(const std::string& instruction_set) {
  const KernelsBySet<LineKernels> kernels = {lineKernelsGeneric(), lineKernelsAvx2(), lineKernelsAvx512()};
  return kernels.choose(instruction_set);
}

}  // namespace bki_mapping
