/// @file The looks of a tile as a map file has them, without rows of voxels that nobody saw. docs/map_file.md
/// specifies the format.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "bki_mapping/map/looks.h"
#include "map/voxel_mask.h"

namespace bki_mapping {

/// The sections that hold the looks of a tile, block after block, and of each block by rising time. A row is
/// a byte, the bits of eight voxels along x.
struct LookSections {
  std::string heads;  ///< for each block, see LookRows::Head; then for each look, its level and age
  std::string seen;   ///< of each look, the rows that any look of the block saw
  std::string voids;  ///< those of the rows that the look itself saw
  std::string hits;   ///< those of them that any look of the block hit
};

/// Appends looks to sections. The looks of a tile are its blocks' in order.
class LookRowsWriter {
 public:
  void clear();
  /// @param looks of the next block that has any.
  void add(const Looks& looks);
  /// The sections; what has been added is then gone.
  LookSections finish();

 private:
  LookSections sections_;
  std::string levels_;
};

/// Reads looks from sections that may be damaged.
class LookRowsReader {
 public:
  /// @param counts the numbers of looks of the blocks that have any. @param heads, seen, voids, hits as in
  /// LookSections. All references must stay.
  LookRowsReader(const std::vector<std::size_t>& counts, const std::string& heads, const std::string& seen,
                 const std::string& voids, const std::string& hits)
      : counts_(counts), sections_{heads, seen, voids, hits} {}

  static std::size_t bytesOfHeads(const std::vector<std::size_t>& counts);
  // How long the other sections must be; each takes those before to be as long as they must.
  std::size_t bytesOfSeen() const;
  std::size_t bytesOfVoids() const { return bytesBySeen(false); }
  std::size_t bytesOfHits() const { return bytesBySeen(true); }

  /// Reads the looks of the next block, once all sections are as long as they must be. @return whether
  /// LookRowsWriter would have written them so.
  bool read(Looks& looks);

 private:
  struct Head {
    std::uint64_t latest, seen_rows, hit_rows;
  };
  Head headOf(std::size_t block) const;
  std::size_t bytesBySeen(bool of_hits) const;

  const std::vector<std::size_t>& counts_;
  struct {
    const std::string &heads, &seen, &voids, &hits;
  } sections_;
  std::size_t block_ = 0, look_ = 0, seen_ = 0, voids_ = 0, hits_ = 0;  ///< what has been read
};

}  // namespace bki_mapping
