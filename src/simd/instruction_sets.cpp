#include "simd/instruction_sets.h"

#include <stdexcept>

namespace bki_mapping {
namespace {

struct Named {
  const char* name;
  InstructionSet set;
};

std::vector<Named> available() {
  std::vector<Named> sets = {{"generic", InstructionSet::kGeneric}};
#if defined(__x86_64__)
  // Both built-ins also ask whether the operating system saves the registers.
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
    sets.push_back({"avx2", InstructionSet::kAvx2});
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("bmi2")) {
      sets.push_back({"avx512", InstructionSet::kAvx512});
    }
  }
#endif
  return sets;
}

}  // namespace

std::vector<std::string> instructionSets() {
  std::vector<std::string> names;
  for (const Named& each : available()) names.push_back(each.name);
  return names;
}

InstructionSet instructionSetFor(const std::string& name) {
  const std::vector<Named> sets = available();
  if (name.empty()) return sets.back().set;
  for (const Named& each : sets) {
    if (each.name == name) return each.set;
  }
  throw std::invalid_argument("instruction set '" + name + "' is not available here");
}

}  // namespace bki_mapping
