/// @file The figures of evaluate_map, for people and programs.
#pragma once

#include <optional>
#include <string>

#include "evaluation/dynamics.h"
#include "evaluation/semantics.h"
#include "evaluation/truth.h"

namespace bki_mapping::tools {

struct MapQuality {
  DynamicsQuality dynamics;
  SemanticQuality semantics;
  std::optional<simulation::TruthQuality> truth;   ///< of simulated drives
  std::map<ClassId, std::size_t> voxels_by_class;  ///< occupied ones
  double median_ms = 0.0;                          ///< time of a scan
  bool labels_are_ids = false;                     ///< which do not tell what moves
  std::size_t labels = 0, unknown_labels = 0;      ///< of all points; of these, not in the class table
  std::uint32_t unknown_label = 0;                 ///< one of these
};

/// A table, one figure a line, with what it means; "-" for shares of nothing.
std::string qualityTable(const MapQuality& quality, const ClassTable& classes);

/// JSON; docs/files.md describes it. Shares of nothing are null.
std::string qualityJson(const MapQuality& quality, const ClassTable& classes);

}  // namespace bki_mapping::tools
