/// @file The free-space modes by name.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "free_space/free_space_model.h"

namespace bki_mapping {

/// Names of all modes, sorted.
std::vector<std::string> freeSpaceModes();

/// Constructs the mode setup.config.mode. @throws std::invalid_argument if it is unknown.
std::unique_ptr<FreeSpaceModel> makeFreeSpaceModel(const FreeSpaceSetup& setup);

}  // namespace bki_mapping
