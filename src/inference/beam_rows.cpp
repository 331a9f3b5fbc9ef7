#include "bki_mapping/inference/beam_rows.h"

#include <stdexcept>

namespace bki_mapping {

void addBeamRowsGeneric(const LocalBeam* beams, std::size_t count, BeamWeight weight, float reach,
                        float* sums);
#ifdef BKI_MAPPING_AVX2
void addBeamRowsAvx2(const LocalBeam* beams, std::size_t count, BeamWeight weight, float reach, float* sums);
#endif

std::vector<std::string> instructionSets() {
  std::vector<std::string> sets = {"generic"};
#ifdef BKI_MAPPING_AVX2
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) sets.push_back("avx2");
#endif
  return sets;
}

AddBeamRows addBeamRowsFor(const std::string& instruction_set) {
  for (const std::string& known : instructionSets()) {
    if (known != instruction_set) continue;
#ifdef BKI_MAPPING_AVX2
    if (known == "avx2") return addBeamRowsAvx2;
#endif
    return addBeamRowsGeneric;
  }
  throw std::invalid_argument("instruction set '" + instruction_set + "' is not available here");
}

}  // namespace bki_mapping
