/// @file The content of a tile as bytes: packed without loss. docs/map_file.md specifies it.
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

/// Packs and unpacks tiles. Keeps its working memory. Not thread-safe.
class TileCodec {
 public:
  /// @param classes of the map.
  explicit TileCodec(const ClassTable& classes);
  ~TileCodec();
  TileCodec(const TileCodec&) = delete;
  TileCodec& operator=(const TileCodec&) = delete;

  /// Packs the blocks that a map has in a tile; blocks and planes without content are left out. The bytes
  /// stay in packed() until the next call. @return an entry with 0 blocks if none is left.
  /// @throws std::invalid_argument if a block has a class that is not in the table.
  TileEntry pack(const SemanticMap& map, const TileKey& key);
  const std::string& packed() const { return packed_; }

  /// Unpacks a tile and checks it. Takes at most kMemoryPerByte times the memory of the packed bytes.
  /// @return what is wrong; "" if nothing is. The content then waits for addTo().
  std::string unpack(const TileKey& key, const TileEntry& entry, const unsigned char* bytes,
                     std::size_t size);
  /// Adds what unpack() has read to a map, as SemanticMap::add does.
  void addTo(SemanticMap& map, const TileKey& key) const;

  /// A plane has one byte in the list of classes, which is not compressed.
  static constexpr std::size_t kMemoryPerByte = kBlockVoxels * sizeof(EvidenceUnits);

 private:
  /// The content, in the pieces that are compressed one by one.
  enum Section : std::size_t {
    kList,   ///< 2 bytes a block: its number; 1: how many planes; 1: whether it has marks; 1 a plane: class
    kMasks,  ///< 512 bits for the occlusion marks of each block with marks, then for each plane: evidence?
    kByte0,  ///< the lowest byte of each evidence other than 0
    kByte1,
    kByte2,
    kByte3,
    kSections
  };
  struct Zlib;

  void clear();
  /// @return whether the plane holds evidence.
  bool takePlane(const EvidenceUnits* units);
  void splitValues();
  void joinValues();
  std::uint32_t checksum(const TileKey& key, const TileEntry& entry) const;
  void appendPacked(Section section);
  /// Checks the list. @param[out] marked number of blocks with occlusion marks.
  std::string checkList(const TileEntry& entry, std::size_t& marked) const;

  std::bitset<256> allowed_;  ///< classes that a plane may have
  std::array<std::string, kSections> sections_;
  std::string packed_, bytes_;
  // Pieces of kList and kMasks:
  std::string numbers_, plane_counts_, marked_, classes_, marks_, evidence_masks_;
  std::vector<std::uint32_t> values_;  ///< evidence other than 0, plane after plane
  int blocks_ = 0;                     ///< that unpack() has read
  std::unique_ptr<Zlib> zlib_;
};

}  // namespace bki_mapping
