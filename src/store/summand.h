/// @file The evidence that a map file holds apart from others, tile by tile.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"
#include "store/grid_transform.h"

namespace bki_mapping {

/// A map file, and where its map lies in another one.
struct PlacedFile {
  MapFile file;
  GridTransform transform;
  bool placed;  ///< false: its map lies in the frame of the other one already
};

/// The evidence of some drives in a map file that cannot be told apart there.
class Summand {
 public:
  /// The evidence in a part.
  Summand(std::shared_ptr<PlacedFile> source, std::set<std::string> drives, int part)
      : Summand(std::move(source), std::move(drives), part, {}) {}
  /// The evidence in a part without that in others, whose sum it holds.
  Summand(std::shared_ptr<PlacedFile> source, std::set<std::string> drives, int part, std::set<int> without)
      : source_(std::move(source)), drives_(std::move(drives)), part_(part), without_(std::move(without)) {}

  /// Ids; at least one.
  const std::set<std::string>& drives() const { return drives_; }
  const std::string& path() const { return source_->file.path(); }
  bool isOf(const PlacedFile& file) const { return source_.get() == &file; }

  /// The tiles of the other map that may hold evidence, sorted. @throws std::invalid_argument if they are too
  /// far from the origin.
  std::vector<GridIndex> tiles() const;
  /// The evidence in a tile of the other map. @throws MapFileError as MapFile, and if evidence that must be
  /// taken from a sum has stopped at the end of its range there.
  SemanticMap read(const GridIndex& tile) const;

 private:
  /// Adds a tile of the file to a map.
  void addStored(SemanticMap& map, const GridIndex& tile) const;

  std::shared_ptr<PlacedFile> source_;
  std::set<std::string> drives_;
  int part_;
  std::set<int> without_;
};

/// What each file holds apart: its parts, what is in none of them, and its sum. Sorted by number of drives,
/// then by ids. @throws MapFileError if a file has evidence, but no drives.
std::vector<Summand> summandsOf(const std::shared_ptr<PlacedFile>& source);

/// Whether two maps hold the same evidence and occlusion marks, to the bit. Neither has empty blocks.
bool sameEvidence(const SemanticMap& a, const SemanticMap& b);

}  // namespace bki_mapping
