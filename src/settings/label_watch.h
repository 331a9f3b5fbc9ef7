/// @file Warns of labels that the class table does not list, with the likeliest remedy.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/scan_stats.h"
#include "core/unlisted_labels.h"

namespace bki_mapping {

class SemanticMapper;

/// Watches the labels of the scans of one source. Its memory, and the number of its sentences, are bounded.
class LabelWatch {
 public:
  /// How the labels of a source are encoded.
  enum class Encoding { kNumber, kRgb, kBgr };
  /// Number of labels that are named in all, and in one sentence.
  static constexpr std::size_t kMostNamed = UnlistedLabels::kMost, kMostInSentence = 8;
  /// Number of different labels, known ones too, on which the remedy rests.
  static constexpr std::size_t kMostSeen = 512;

  /// @return one sentence about the labels of a scan that the table does not list, and that no earlier
  /// sentence has named; "" if there are none. @param labels of the scan, as the source sent them; empty if
  /// only `unlisted` has them so. @param unlisted those that the table does not list. @param values ignored
  /// for colours.
  std::string report(const ClassTable& classes, UnknownLabels treatment, const PointCounts& counts,
                     Span<const std::uint32_t> labels, const UnlistedLabels& unlisted, LabelValues values,
                     Encoding encoding = Encoding::kNumber);
  /// The same for a scan that a mapper has integrated.
  std::string report(const SemanticMapper& mapper, const ScanView& scan, const PointCounts& counts);

  /// What would help, given all labels seen so far, as a clause; "" as long as all were in the table.
  const std::string& remedy() const { return remedy_; }

 private:
  /// Takes note of labels. @return whether any is new.
  bool see(Span<const std::uint32_t> labels, const UnlistedLabels& unlisted);
  std::string findRemedy(const ClassTable& classes, const UnlistedLabels& unlisted, LabelValues values,
                         Encoding encoding);
  /// Names the labels that no sentence has named before, the most frequent ones first.
  std::string nameNew(const UnlistedLabels& unlisted, Encoding encoding);

  std::set<std::int64_t> seen_, named_;
  bool named_missing_ = false, said_last_ = false;
  std::optional<std::vector<ClassTable>> known_tables_;  ///< those of config/classes; read when first needed
  std::string remedy_;
};

/// The clause of the remedy for labels that a table does not list. @param seen all labels of a source, listed
/// or not; as 0xRRGGBB those of colours. @param known tables that could be used instead.
std::string labelRemedy(const std::set<std::int64_t>& seen, const ClassTable& classes, LabelValues values,
                        LabelWatch::Encoding encoding, const std::vector<ClassTable>& known);

}  // namespace bki_mapping
