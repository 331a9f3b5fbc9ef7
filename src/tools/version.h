/// @file The version of the programs.
#pragma once

namespace bki_mapping::tools {

/// As in package.xml: "0.2.0".
const char* version();

}  // namespace bki_mapping::tools
