/// @file Locates the package's own files, in a build tree and in an installation.
#pragma once

#include <string>

namespace bki_mapping {

/// The folder with config/, launch/ and so on: share/bki_mapping next to the library's folder if installed,
/// otherwise the source tree that the library was built from.
std::string sharePath();

}  // namespace bki_mapping
