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
#include "store/evidence_steps.h"
#include "store/look_rows.h"

namespace bki_mapping {

/// How tiles hold what they hold. Each layout changes one thing of the one before.
enum class TileLayout {
  kNoLooks,    ///< before version 3 of map files
  kLookMasks,  ///< looks with two bits for each voxel: in versions 3 and 4
  kLookRows,   ///< looks without rows of voxels that nobody saw: in version 5
  kSteps,      ///< evidence as multiples of what scans add: since version 6
};

/// @param version of a map file.
TileLayout tileLayoutOf(std::int64_t version);

/// The rules of settings in a map file, as far as they say which steps evidence has. @param parameters YAML;
/// if they cannot be read, the rules are those of RulesConfig.
RulesConfig rulesOfParameters(const std::string& parameters);

/// Packs and unpacks tiles. Keeps its working memory from tile to tile. Not thread-safe.
class TileCodec {
 public:
  explicit TileCodec(const ClassTable& classes, TileLayout layout = TileLayout::kSteps);
  ~TileCodec();
  TileCodec(const TileCodec&) = delete;
  TileCodec& operator=(const TileCodec&) = delete;

  /// The rules with which the map was made: with their steps, tiles take less space. By default, those of
  /// RulesConfig.
  void setRules(const RulesConfig& rules) { rules_ = rules; }

  /// Packs the blocks that a map has in a tile, and leaves out empty blocks and planes. The bytes stay in
  /// packed() until the next call. @return the tile's entry; it has 0 blocks if all are empty.
  /// @throws std::invalid_argument if a block has a class that is not in the table.
  TileEntry pack(const SemanticMap& map, const TileKey& key);
  const std::string& packed() const { return packed_; }

  /// Unpacks a tile and checks it. Uses at most kMemoryPerByte bytes of memory for each packed byte, and half
  /// a megabyte.
  /// @return what is wrong with it; "" if nothing is, and the content is ready for addTo().
  std::string unpack(const TileKey& key, const TileEntry& entry, const unsigned char* bytes,
                     std::size_t size);
  /// Adds the content that unpack() has read to a map, as SemanticMap::add does.
  void addTo(SemanticMap& map, const TileKey& key) const;

  /// A plane takes one byte in the list of classes, which is not compressed, and at least half a byte in a
  /// section of values. A look takes one in the heads, and the rows of looks bring what they take.
  static constexpr std::size_t kMemoryPerByte = kBlockVoxels * sizeof(EvidenceUnits);

 private:
  /// The sections of the content, each compressed by itself.
  enum Section : std::size_t {
    kList,    ///< for each block its number (2 bytes), number of planes, and flags; then classes
    kMasks,   ///< 512 bits for the marks of each block that has any; then for each plane, where evidence is
    kValues,  ///< EvidenceSections; before kSteps: the four bytes of each evidence other than 0, lowest first
    kLooks = kValues + EvidenceSections::kSections,  ///< LookSections, only if a block has looks; kLookMasks:
                                                     ///< begins and masks, and levels in the list
    kSeen,
    kVoids,
    kHits,
    kSections
  };
  /// Of a value.
  static constexpr std::size_t kBytes = sizeof(EvidenceUnits);
  struct Zlib;

  void clear();
  /// Calls add(bytes) with pieces of one of the four bytes of each value, plane after plane.
  template <typename Add>
  void forEachPiece(std::size_t byte, Add&& add) const;
  /// @return whether the plane holds evidence.
  bool takePlane(ClassId id, const EvidenceUnits* units);
  void splitValues();
  void joinValues();
  /// Does not depend on the layout of the evidence.
  std::uint32_t checksum(const TileKey& key, const TileEntry& entry) const;
  /// Where the length of a section is, the n-th of those before looks.
  std::size_t lengthAt(std::size_t n) const;
  /// Writes what comes before the sections, without their lengths. @return those before looks.
  std::vector<Section> beginPacked();
  /// @return the length of the section in the content.
  std::size_t appendPacked(Section section);
  void takeMasks(const Looks& looks);

  // Parts of unpack(), in this order. Each returns what is wrong, or "".
  struct Input;
  /// Reads what comes before the sections, but for their lengths.
  std::string readHead(Input& input);
  /// Reads kList and kMasks, and from them planes_ and look_counts_.
  std::string unpackPlanes(const TileEntry& entry, Input& input);
  /// Decompresses the sections of values.
  std::string unpackValues(Input& input);
  /// Decompresses those of looks.
  std::string unpackLooks(Input& input);
  /// Once the checksum is right: makes the looks of all blocks that have any; these must have the intervals
  /// that their latest demands.
  std::string readLooks();

  /// Decompresses a section. @param length in the input. @param wanted length of the content. @return what is
  /// wrong, or "".
  std::string take(Section section, std::size_t length, std::size_t wanted, Input& input);
  /// The same of a section whose length is the next one before all sections.
  std::string takeListed(Section section, std::size_t wanted, Input& input);
  /// The same of a section whose length is right before it.
  std::string takeNext(Section section, std::size_t wanted, Input& input);
  /// Checks the list, and reads look_counts_ from it. @param[out] marked number of blocks with occlusion
  /// marks.
  std::string checkList(const TileEntry& entry, std::size_t& marked);
  bool hasLookRows() const { return layout_ >= TileLayout::kLookRows; }
  // The sections of the layout:
  std::size_t endOfValues() const { return layout_ == TileLayout::kSteps ? kLooks : kValues + kBytes; }
  std::size_t endOfSections() const { return hasLookRows() ? kSections : kSeen; }
  /// Reads looks from masks. @param[in,out] next position of the first one; then of the one after the last.
  Looks masksAt(std::size_t& next, std::size_t count) const;

  TileLayout layout_;
  std::bitset<256> allowed_;  ///< the class ids that planes may have
  std::array<std::string, kSections> sections_;
  std::string packed_;
  // Parts of kList and kMasks:
  std::string numbers_, plane_counts_, flags_, classes_, levels_, marks_, evidence_masks_;
  std::string begins_, look_masks_;  ///< parts of kLooks with kLookMasks
  LookRowsWriter look_rows_;
  std::vector<std::size_t> look_counts_;  ///< of the blocks that have looks
  std::vector<Looks> looks_;              ///< that unpack() has read, of these blocks
  EvidenceSections::Values values_;       ///< evidence other than 0, plane after plane
  EvidenceSections::Planes planes_;
  EvidenceSections::StepsOfKinds steps_;
  RulesConfig rules_;
  int blocks_ = 0;  ///< number of blocks that unpack() has read
  std::unique_ptr<Zlib> zlib_;
};

}  // namespace bki_mapping
