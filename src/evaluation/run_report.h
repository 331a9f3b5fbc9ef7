/// @file What a run did, as JSON.
#pragma once

#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"

namespace bki_mapping {

/// One scan of a run.
struct ScanReport {
  std::string name;
  ScanStats stats;
};

/// The p-quantile of some values (nearest rank), 0 if there are none. @param p in [0, 1].
double quantile(std::vector<double> values, double p);

/// The largest resident size that this process has had so far [bytes].
std::size_t peakResidentBytes();

/// The report of a run; docs/files.md describes its fields.
std::string reportJson(const SemanticMapper& mapper, const std::vector<ScanReport>& scans);

/// A few lines for people: times, voxels by state and by class.
std::string summaryText(const SemanticMapper& mapper, const std::vector<ScanReport>& scans);

}  // namespace bki_mapping
