#include "simd/instruction_sets.h"

#include <cstdlib>
#include <stdexcept>

namespace bki_mapping {
namespace {

struct Named {
  const char* name;
  InstructionSet set;
};

std::vector<Named> ofThisProcessor() {
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

/// The sets of this processor up to the one that the environment names.
std::vector<Named> allowed() {
  const std::vector<Named> all = ofThisProcessor();
  const char* const fastest = std::getenv(kInstructionSetVariable);
  if (!fastest || *fastest == '\0') return all;
  std::string names;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (std::string(fastest) == all[i].name) return {all.begin(), all.begin() + static_cast<long>(i) + 1};
    names += (i ? ", " : "") + std::string(all[i].name);
  }
  throw std::invalid_argument(
      "environment variable " + std::string(kInstructionSetVariable) + " is '" + fastest +
      "', which this processor does not have; unset it, or set it to one of: " + names);
}

const std::vector<Named>& available() {
  static const std::vector<Named> sets = allowed();
  return sets;
}

}  // namespace

std::vector<std::string> instructionSets() {
  std::vector<std::string> names;
  for (const Named& each : available()) names.push_back(each.name);
  return names;
}

InstructionSet instructionSetFor(const std::string& name) {
  const std::vector<Named>& sets = available();
  if (name.empty()) return sets.back().set;
  for (const Named& each : sets) {
    if (each.name == name) return each.set;
  }
  throw std::invalid_argument("instruction set '" + name + "' is not available here");
}

}  // namespace bki_mapping
