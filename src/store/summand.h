/// @file Summands of a map file: the evidence of some of its drives, separate from the others.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"
#include "store/grid_transform.h"

namespace bki_mapping {

/// A map file, and the placement of its map in the frame of the result.
struct PlacedFile {
  MapFile file;
  GridTransform transform;
  bool placed;  ///< false: the map's own frame is that of the result
};

/// The sum of the evidence of some drives, which a map file holds separate from its other drives. Read tile
/// by tile.
class Summand {
 public:
  /// The evidence in a part.
  Summand(std::shared_ptr<PlacedFile> source, std::set<std::string> drives, int part)
      : Summand(std::move(source), std::move(drives), part, {}) {}
  /// The evidence in a part minus the evidence in other parts. @param without parts that the part contains.
  Summand(std::shared_ptr<PlacedFile> source, std::set<std::string> drives, int part, std::set<int> without)
      : source_(std::move(source)), drives_(std::move(drives)), part_(part), without_(std::move(without)) {}

  /// The ids of the drives; at least one.
  const std::set<std::string>& drives() const { return drives_; }
  const std::string& path() const { return source_->file.path(); }
  bool isOf(const PlacedFile& file) const { return source_.get() == &file; }

  /// The tiles of the result that may receive evidence, sorted. @throws std::invalid_argument if they are too
  /// far from the origin.
  std::vector<GridIndex> tiles() const;
  /// The evidence for a tile of the result. @throws MapFileError as MapFile does, and if evidence must be
  /// subtracted from a sum that is saturated there.
  SemanticMap read(const GridIndex& tile) const;

 private:
  /// Adds a tile of the file to a map.
  void addStored(SemanticMap& map, const GridIndex& tile) const;

  std::shared_ptr<PlacedFile> source_;
  std::set<std::string> drives_;
  int part_;
  std::set<int> without_;
};

/// All summands of a file: each of its parts, the rest that is in no part, and the sum of all. Sorted by
/// number of drives, then by ids. @throws MapFileError if a file has evidence, but no drives.
std::vector<Summand> summandsOf(const std::shared_ptr<PlacedFile>& source);

/// Whether two maps hold the same evidence and occlusion marks, to the bit. Neither has empty blocks.
bool sameEvidence(const SemanticMap& a, const SemanticMap& b);

}  // namespace bki_mapping
