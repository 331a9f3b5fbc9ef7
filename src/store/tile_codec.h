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

namespace bki_mapping {

/// Packs and unpacks tiles. Keeps its working memory from tile to tile. Not thread-safe.
class TileCodec {
 public:
  /// @param classes of the map. @param keeps_looks false for files of versions before 3, which have no looks.
  explicit TileCodec(const ClassTable& classes, bool keeps_looks = true);
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
    kList,   ///< for each block its number (2 bytes), number of planes, and flags; then classes, then levels
    kMasks,  ///< 512 bits for the marks of each block that has any; then for each plane, where evidence is
    kByte0,  ///< the lowest byte of each evidence other than 0
    kByte1,
    kByte2,
    kByte3,
    kLooks,  ///< only if a block has looks: the begin of each (8 bytes), then 2 x 512 bits for each
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
  void takeLooks(const Looks& looks);
  /// Checks the list. @param[out] marked number of blocks with occlusion marks. @param[out] looks number of
  /// looks.
  std::string checkList(const TileEntry& entry, std::size_t& marked, std::size_t& looks) const;
  /// Checks kLooks: each block must have the intervals that its latest one demands.
  std::string checkLooks(const TileEntry& entry, std::size_t looks) const;
  /// Reads the looks of a block. @param[in,out] next position of its first one; then of the next block's.
  Looks looksAt(std::size_t& next, std::size_t count) const;

  bool keeps_looks_;
  std::bitset<256> allowed_;  ///< the class ids that planes may have
  std::array<std::string, kSections> sections_;
  std::string packed_, bytes_;
  // Parts of kList and kMasks:
  std::string numbers_, plane_counts_, flags_, classes_, levels_, marks_, evidence_masks_;
  std::string begins_, look_masks_;    ///< parts of kLooks
  std::size_t looks_ = 0;              ///< number of looks that unpack() has read
  std::vector<std::uint32_t> values_;  ///< evidence other than 0, plane after plane
  int blocks_ = 0;                     ///< number of blocks that unpack() has read
  std::unique_ptr<Zlib> zlib_;
};

}  // namespace bki_mapping
