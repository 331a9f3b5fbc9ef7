#include "tools/version.h"

namespace bki_mapping::tools {

const char* version() {
  return BKI_MAPPING_VERSION;
}

}  // namespace bki_mapping::tools
