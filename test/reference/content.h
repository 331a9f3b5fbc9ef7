/// @file What a map holds, to be compared to the bit.
#pragma once

#include <map>
#include <string>

#include "bki_mapping/map/semantic_map.h"

namespace bki_mapping::reference {

/// The classes, the planes, the occlusion marks and the looks of each block as bytes.
inline std::map<GridIndex, std::string> contentOf(const SemanticMap& map) {
  std::map<GridIndex, std::string> content;
  for (const auto& [index, block] : map.entries()) {
    std::string& text = content[index];
    for (std::size_t c = 0; c < block->classes().size(); ++c) {
      text += static_cast<char>(block->classes()[c]);
      text.append(reinterpret_cast<const char*>(block->plane(c)), kBlockVoxels * sizeof(EvidenceUnits));
    }
    text += block->occlusion().to_string();
    for (const Look& look : block->looks().all()) {
      text += " " + std::to_string(look.begin()) + " " + std::to_string(look.level()) + " ";
      text += look.low().to_string() + look.high().to_string();
    }
  }
  return content;
}

}  // namespace bki_mapping::reference
