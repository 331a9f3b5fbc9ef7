/// @file Runs the plotting scripts of the package.
#pragma once

#include <string>
#include <vector>

namespace bki_mapping::tools {

/// Runs lab/tools/NAME with python3 and matplotlib. @throws std::runtime_error if it fails.
void draw(const std::string& name, const std::vector<std::string>& arguments);

}  // namespace bki_mapping::tools
