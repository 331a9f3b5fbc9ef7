#include "settings/named_file.h"

#include <dlfcn.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "bki_mapping/core/named_parameter.h"

namespace bki_mapping {
namespace {

namespace fs = std::filesystem;

/// The name, and the absolute path of a relative one: a node runs in another folder than the shell.
std::string triedText(const fs::path& file) {
  const std::string text = "'" + file.string() + "'";
  const bool is_path = file.has_parent_path() || file.has_extension();
  if (!is_path || file.is_absolute()) return text;
  std::error_code ignored;
  return text + " (" + fs::absolute(file, ignored).lexically_normal().string() + ")";
}

}  // namespace

std::string findNamedFile(const std::string& what, const std::string& folder,
                          const std::string& name_or_file) {
  std::error_code ignored;
  if (fs::is_regular_file(name_or_file, ignored)) return name_or_file;
  const fs::path package = fs::path(sharePath()) / folder;
  const std::vector<std::string> known = namedFiles(folder);
  if (indexOf(known, name_or_file)) return (package / (name_or_file + ".yaml")).string();
  throw std::invalid_argument(what + " " + triedText(name_or_file) + " is neither a file nor " +
                              wordsText(known) + nearestWord(fs::path(name_or_file).stem().string(), known));
}

std::vector<std::string> namedFiles(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(fs::path(sharePath()) / folder, ignored)) {
    if (entry.path().extension() == ".yaml") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string sharePath() {
  Dl_info library{};
  if (dladdr(reinterpret_cast<void*>(&sharePath), &library) != 0 && library.dli_fname != nullptr) {
    std::error_code ignored;
    const fs::path lib = fs::canonical(library.dli_fname, ignored).parent_path();
    for (const fs::path& prefix :
         {lib.parent_path(), lib.parent_path().parent_path()}) {  // lib or lib/<architecture>
      const fs::path share = prefix / "share" / "bki_mapping";
      if (fs::exists(share / "config" / "classes", ignored)) return share.string();
    }
  }
  return BKI_MAPPING_SOURCE_DIR;
}

}  // namespace bki_mapping
