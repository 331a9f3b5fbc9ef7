#include "query/distance_kernels.h"

#include "simd/instruction_sets.h"

namespace bki_mapping {

const DistanceKernels& distanceKernelsGeneric();
const DistanceKernels& distanceKernelsAvx2();
const DistanceKernels& distanceKernelsAvx512();

const DistanceKernels& distanceKernelsFor(const std::string& instruction_set) {
  const KernelsBySet<DistanceKernels> kernels = {distanceKernelsGeneric(), distanceKernelsAvx2(),
                                                 distanceKernelsAvx512()};
  return kernels.choose(instruction_set);
}

}  // namespace bki_mapping
