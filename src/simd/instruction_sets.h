/// @file The instruction sets for which the loops over points and lines are compiled.
#pragma once

#include <string>
#include <vector>

namespace bki_mapping {

enum class InstructionSet { kGeneric, kAvx2, kAvx512 };

/// Environment variable that names the fastest instruction set which a process may use, so that processors
/// that differ compute the same bits. Read once, when the first mapper is made or the first block is read.
constexpr const char* kInstructionSetVariable = "BKI_MAPPING_INSTRUCTION_SET";

/// The names of the instruction sets that this build and this processor have, and the environment allows,
/// from the slowest, "generic", to the fastest.
/// @throws std::invalid_argument if the environment names one that is not there.
std::vector<std::string> instructionSets();

/// One of instructionSets() by its name; the fastest if the name is empty.
/// @throws std::invalid_argument for any other name.
InstructionSet instructionSetFor(const std::string& name);

/// A table of kernels for each instruction set.
template <typename Kernels>
struct KernelsBySet {
  const Kernels &generic, &avx2, &avx512;

  /// @param name as for instructionSetFor.
  const Kernels& choose(const std::string& name) const {
    switch (instructionSetFor(name)) {
      case InstructionSet::kAvx512:
        return avx512;
      case InstructionSet::kAvx2:
        return avx2;
      default:
        return generic;
    }
  }
};

}  // namespace bki_mapping
