/// @file Where the package's own files are, in a build tree and in an installation.
#pragma once

#include <string>

namespace bki_mapping {

/// The folder with config/, launch/ and so on: share/bki_mapping beside the library's folder when installed,
/// else the source tree it was built from.
std::string sharePath();

}  // namespace bki_mapping
