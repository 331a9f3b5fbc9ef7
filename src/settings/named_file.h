/// @file Files that users give by path, or by name where the package brings them.
#pragma once

#include <string>
#include <vector>

namespace bki_mapping {

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
