#include "points/point_kernels.h"

#include "simd/instruction_sets.h"

namespace bki_mapping {

const PointKernels& pointKernelsGeneric();
const PointKernels& pointKernelsAvx2();
const PointKernels& pointKernelsAvx512();

const PointKernels& pointKernelsFor(const std::string& instruction_set) {
  const KernelsBySet<PointKernels> kernels = {pointKernelsGeneric(), pointKernelsAvx2(),
                                              pointKernelsAvx512()};
  return kernels.choose(instruction_set);
}

}  // namespace bki_mapping
