/// @file How a scan tells which space is free.
#pragma once

#include "bki_mapping/core/config.h"
#include "bki_mapping/inference/beam_field.h"

namespace bki_mapping {

struct FreeSpaceEvidence {
  Evidence* evidence = nullptr;  ///< of the model, until its next scan; nullptr: none
  std::size_t count = 0;         ///< samples (after down-sampling) or beams behind it
};

/// A free-space mode: a maker of evidence for `free`. Keeps its memory from scan to scan.
class FreeSpaceModel {
 public:
  virtual ~FreeSpaceModel() = default;
  /// Whether observe() looks at beams.
  virtual bool needsBeams() const { return true; }
  /// @param beams of one scan. @param stamp of the scan [ns], a key of random samples.
  virtual FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t stamp, Workers& workers) = 0;
};

}  // namespace bki_mapping
