/// @file One factory function for each mode; registry.cpp gives the modes their names.
#pragma once

#include <memory>

#include "free_space/free_space_model.h"

namespace bki_mapping {

std::unique_ptr<FreeSpaceModel> makeNoFreeSpace(const FreeSpaceSetup& setup);
std::unique_ptr<FreeSpaceModel> makeEvenSamples(const FreeSpaceSetup& setup);
std::unique_ptr<FreeSpaceModel> makeUniformSamples(const FreeSpaceSetup& setup);
std::unique_ptr<FreeSpaceModel> makeLinearSamples(const FreeSpaceSetup& setup);
std::unique_ptr<FreeSpaceModel> makeBeamLines(const FreeSpaceSetup& setup);

}  // namespace bki_mapping
