/// @file Maps a sequence as a robot does whose SLAM system corrects the poses of the past.
#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/sequence/sequence.h"
#include "journal/kept_scans.h"
#include "tools/options.h"

namespace bki_mapping::tools {

/// Adds --trajectory-updates and --correction-tolerance.
void addTrajectoryUpdates(po::options_description& options);

/// Adds scans to a mapper, rounds and keeps them, and moves them when the list of updates says so.
class JournalledMapping {
 public:
  /// @return nullptr if the options ask for no journal.
  /// @throws std::invalid_argument, std::runtime_error if the list of updates, or a file of it, cannot be
  /// read.
  static std::unique_ptr<JournalledMapping> begin(const po::variables_map& given, SemanticMapper& mapper);

  /// Adds a scan, and corrects the map if an update follows it. @param i of the scan in the sequence.
  ScanStats integrate(const Sequence& sequence, std::size_t i, const SequenceFrame& frame);
  /// Moves all scans that are still to be moved.
  void finish();
  const KeptScans& kept() const { return kept_; }
  /// What the corrections did, in a few lines for people.
  std::string summary() const;

 private:
  struct Update {
    std::size_t scan;   ///< number of the scan after which it comes
    std::string poses;  ///< file
  };
  JournalledMapping(SemanticMapper& mapper, const MapCorrector::Settings& settings)
      : kept_(mapper, settings) {}
  /// Reads the list. @param sequence for the reading of poses.
  void readUpdates(const std::string& path);

  KeptScans kept_;
  SequenceOptions poses_;  ///< how files of poses are to be read
  std::vector<Update> updates_;
  std::size_t next_ = 0;             ///< update
  std::vector<std::size_t> mapped_;  ///< scans of the sequence
  double waited_ms_ = 0.0;           ///< by finish()
};

}  // namespace bki_mapping::tools
