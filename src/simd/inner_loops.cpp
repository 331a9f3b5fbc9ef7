#include "simd/inner_loops.h"

#include <stdexcept>

namespace bki_mapping {

const InnerLoops& innerLoopsGeneric();
#ifdef BKI_MAPPING_X86
const InnerLoops& innerLoopsAvx2();
const InnerLoops& innerLoopsAvx512();
#endif

namespace {

std::vector<const InnerLoops*> available() {
  std::vector<const InnerLoops*> loops = {&innerLoopsGeneric()};
#ifdef BKI_MAPPING_X86
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    loops.push_back(&innerLoopsAvx2());
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("bmi2")) {
      loops.push_back(&innerLoopsAvx512());
    }
  }
#endif
  return loops;
}

}  // namespace

std::vector<std::string> instructionSets() {
  std::vector<std::string> names;
  for (const InnerLoops* loops : available()) names.push_back(loops->instruction_set);
  return names;
}

const InnerLoops& innerLoopsFor(const std::string& instruction_set) {
  const auto loops = available();
  if (instruction_set.empty()) return *loops.back();
  for (const InnerLoops* each : loops) {
    if (each->instruction_set == instruction_set) return *each;
  }
  throw std::invalid_argument("instruction set '" + instruction_set + "' is not available here");
}

}  // namespace bki_mapping
