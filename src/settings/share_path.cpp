#include "settings/share_path.h"

#include <dlfcn.h>

#include <filesystem>

namespace bki_mapping {

std::string sharePath() {
  namespace fs = std::filesystem;
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
