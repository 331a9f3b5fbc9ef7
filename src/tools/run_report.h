/// @file The report of a run: as JSON, and as a few lines of text.
#pragma once

#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "journal/kept_scans.h"

namespace bki_mapping::tools {

/// One scan of a run.
struct ScanReport {
  std::string name;
  ScanStats stats;
};

/// The peak resident memory of this process so far [bytes].
std::size_t peakResidentBytes();

/// The report of a run; docs/files.md describes its fields.
std::string reportJson(const SemanticMapper& mapper, const std::vector<ScanReport>& scans);

/// A few lines for people: times, voxels by state and by class.
std::string summaryText(const SemanticMapper& mapper, const std::vector<ScanReport>& scans);
/// A line on scans that are kept.
std::string summaryText(const KeptScans& kept);

}  // namespace bki_mapping::tools
