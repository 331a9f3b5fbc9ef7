/// @file Packs the content of a tile into bytes, without loss. docs/map_file.md specifies the format.
#pragma once

#include <array>
#include <bitset>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "bki_mapping/map/semantic_map.h"
#include "bki_mapping/store/map_file.h"
#include "store/look_rows.h"

namespace bki_mapping {

/// How tiles hold looks.
enum class LooksLayout {
  kNone,   ///< not at all: before version 3 of map files
  kMasks,  ///< with two bits for each voxel: in versions 3 and 4
  kRows,   ///< without rows of voxels that nobody saw
};

/// @param version of a map file.
LooksLayout looksLayoutOf(std::int64_t version);

/// Packs and unpacks tiles. Keeps its working memory from tile to tile. Not thread-safe.
class TileCodec {
 public:
  explicit TileCodec(const ClassTable& classes, LooksLayout layout = LooksLayout::kRows);
  ~TileCodec();
  TileCodec(const TileCodec&) = delete;
  TileCodec& operator=(const TileCodec&) = delete;

  /// Packs the blocks that a map has in a tile, and leaves out empty blocks and planes. The bytes stay in
  /// packed() until the next call. @return the tile's entry; it has 0 blocks if all are empty.
  /// @throws std::invalid_argument if a block has a class that is not in the table.
  TileEntry pack(const SemanticMap& map, const TileKey& key);
  const std::string& packed() const { return packed_; }

  /// Unpacks a tile and checks it. Uses at most kMemoryPerByte bytes of memory for each packed byte.
  /// @return what is wrong with it; "" if nothing is, and the content is ready for addTo().
  std::string unpack(const TileKey& key, const TileEntry& entry, const unsigned char* bytes,
                     std::size_t size);
  /// Adds the content that unpack() has read to a map, as SemanticMap::add does.
  void addTo(SemanticMap& map, const TileKey& key) const;

  /// A plane has one byte in the list of classes, which is not compressed, and so has a look.
  static constexpr std::size_t kMemoryPerByte = kBlockVoxels * sizeof(EvidenceUnits);

 private:
  /// The sections of the content, each compressed by itself.
  enum Section : std::size_t {
    kList,   ///< for each block its number (2 bytes), number of planes, and flags; then classes
    kMasks,  ///< 512 bits for the marks of each block that has any; then for each plane, where evidence is
    kByte0,  ///< the lowest byte of each evidence other than 0
    kByte1,
    kByte2,
    kByte3,
    kLooks,  ///< LookSections, only if a block has looks; kMasks: begins and masks, and levels in the list
    kSeen,
    kVoids,
    kHits,
    kSections
  };
  struct Zlib;

  void clear();
  /// @return whether the plane holds evidence.
  bool takePlane(const EvidenceUnits* units);
  void splitValues();
  void joinValues();
  std::uint32_t checksum(const TileKey& key, const TileEntry& entry) const;
  /// @return the length of the section in the content.
  std::size_t appendPacked(Section section);
  void takeMasks(const Looks& looks);
  /// Checks the list, and reads look_counts_ from it. @param[out] marked number of blocks with occlusion
  /// marks.
  std::string checkList(const TileEntry& entry, std::size_t& marked);
  /// The sections of the layout.
  std::size_t endOfSections() const { return layout_ == LooksLayout::kRows ? kSections : kSeen; }
  /// Reads the looks of all blocks that have any; these must have the intervals that their latest demands.
  std::string readLooks();
  /// Reads looks from masks. @param[in,out] next position of the first one; then of the one after the last.
  Looks masksAt(std::size_t& next, std::size_t count) const;

  LooksLayout layout_;
  std::bitset<256> allowed_;  ///< the class ids that planes may have
  std::array<std::string, kSections> sections_;
  std::string packed_, bytes_;
  // Parts of kList and kMasks:
  std::string numbers_, plane_counts_, flags_, classes_, levels_, marks_, evidence_masks_;
  std::string begins_, look_masks_;  ///< parts of kLooks with kMasks
  LookRowsWriter look_rows_;
  std::vector<std::size_t> look_counts_;  ///< of the blocks that have looks
  std::vector<Looks> looks_;              ///< that unpack() has read, of these blocks
  std::vector<std::uint32_t> values_;     ///< evidence other than 0, plane after plane
  int blocks_ = 0;                        ///< number of blocks that unpack() has read
  std::unique_ptr<Zlib> zlib_;
};

}  // namespace bki_mapping
