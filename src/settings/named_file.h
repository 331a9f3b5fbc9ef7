/// @file Files of the package, in a build tree and in an installation, and files that users give by path or
/// by the name of one of these.
#pragma once

#include <string>
#include <vector>

namespace bki_mapping {

/// The folder with config/, launch/ and so on: share/bki_mapping next to the library's folder if installed,
/// otherwise the source tree that the library was built from.
std::string sharePath();

/// The path of a file. A file that exists goes before the package's file of the same name.
/// @param what kind of file, for the sentence of the exception.
/// @param folder of the package's files of this kind, relative to sharePath().
/// @param name_or_file the name of one of these without .yaml, or the path of any file.
/// @throws std::invalid_argument if there is neither, with the known names and the path that was tried.
std::string findNamedFile(const std::string& what, const std::string& folder,
                          const std::string& name_or_file);

/// The names of the package's files in a folder, without .yaml, sorted.
std::vector<std::string> namedFiles(const std::string& folder);

}  // namespace bki_mapping
