/// @file One maker a mode; registry.cpp gives them names.
#pragma once

#include <memory>

#include "bki_mapping/free_space/free_space_model.h"

namespace bki_mapping {

std::unique_ptr<FreeSpaceModel> makeNoFreeSpace(const MapperConfig& config);
std::unique_ptr<FreeSpaceModel> makeEvenSamples(const MapperConfig& config);
std::unique_ptr<FreeSpaceModel> makeUniformSamples(const MapperConfig& config);
std::unique_ptr<FreeSpaceModel> makeLinearSamples(const MapperConfig& config);
std::unique_ptr<FreeSpaceModel> makeBeamLines(const MapperConfig& config);

}  // namespace bki_mapping
