/// @file The interface of a free-space mode: from beams to evidence for `free`.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "beams/beam_field.h"
#include "bki_mapping/free_space/free_space_config.h"
#include "update/evidence.h"

namespace bki_mapping {

/// The settings from which a mode is constructed.
struct FreeSpaceSetup {
  FreeSpaceConfig config;
  GridGeometry geometry;
  KernelConfig kernel;
  double downsample_resolution;  ///< edge of a down-sampling cell [m]; 0: off
};

struct FreeSpaceEvidence {
  Evidence* evidence = nullptr;  ///< owned by the model and valid until its next scan; nullptr: none
  std::size_t count = 0;         ///< samples after down-sampling, or beams
};

/// A free-space mode: computes evidence for `free`. Keeps its memory from scan to scan.
class FreeSpaceModel {
 public:
  virtual ~FreeSpaceModel() = default;
  /// Whether observe() uses the beams.
  virtual bool needsBeams() const { return true; }
  /// @param beams of one scan. @param stamp of the scan [ns], a key of the random samples.
  virtual FreeSpaceEvidence observe(LazyBeamField& beams, std::uint64_t stamp, ThreadPool& pool) = 0;
  /// Whether that evidence depends on the blocks that the map has, and so on the order of scans.
  virtual bool dependsOnMap() const { return false; }
};

/// Names of all modes, sorted.
std::vector<std::string> freeSpaceModes();

/// Constructs the mode setup.config.mode. @throws std::invalid_argument if it is unknown.
std::unique_ptr<FreeSpaceModel> makeFreeSpaceModel(const FreeSpaceSetup& setup);

}  // namespace bki_mapping
