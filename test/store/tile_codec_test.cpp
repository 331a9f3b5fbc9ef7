// The content of a tile, as it is specified; and as it must not be.
#include "store/tile_codec.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <cstring>
#include <limits>
#include <random>

#include "reference/content.h"
#include "store/counted_memory.h"
#include "store/map_maker.h"

namespace bki_mapping {
namespace {

/// Those from the seventh on, the looks, are left out if that is empty.
using Sections = std::array<std::string, 10>;

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
            bytes.size(), 9);
  packed.resize(size);
  return packed;
}

std::string lengthOf(const std::string& section) {
  std::string bytes;
  for (unsigned shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(section.size() >> shift);
  return bytes;
}

/// @param last section that may be there.
std::string joined(const Sections& sections, std::size_t last) {
  std::string lengths, content;
  for (std::size_t s = 0; s < 6; ++s) {
    lengths += lengthOf(sections[s]);
    content += sections[s];
  }
  for (std::size_t s = 6; s <= last && !sections[6].empty(); ++s)
    content += lengthOf(sections[s]) + sections[s];
  return lengths + content;
}

/// docs/map_file.md. @param sections not compressed.
std::uint32_t checksumOf(const TileKey& key, const TileEntry& entry, const Sections& sections) {
  uLong sum = 0;
  for (const int number : {key.part, key.index.x, key.index.y, key.index.z, entry.blocks, entry.planes}) {
    sum = crc32(sum, reinterpret_cast<const Bytef*>(&number), 4);
  }
  for (const std::string& section : sections) {
    sum = crc32(sum, reinterpret_cast<const Bytef*>(section.data()), static_cast<uInt>(section.size()));
  }
  return static_cast<std::uint32_t>(sum);
}

/// Block 0 with occlusion marks alone; block 511 with the classes 40 and `free`, which have evidence at
/// voxel 8.
class TileCodecTest : public testing::Test {
 protected:
  explicit TileCodecTest(TileLayout layout = TileLayout::kLookRows)
      : codec_(*infoOf().classes, layout), last_section_(layout == TileLayout::kLookRows ? 9 : 6) {
    sections_[0] = std::string("\0\0\xff\1\0\2\1\0", 8) + "\x28\xff";
    sections_[1].resize(3 * 64);
    sections_[1][5] = '\3';
    sections_[1][64 + 1] = sections_[1][128 + 1] = '\1';
    sections_[2] = "\1\xff";
    sections_[3] = std::string("\0\xff", 2);
    sections_[4] = std::string("\0\xff", 2);
    sections_[5] = std::string("\0\xff", 2);
  }
  /// What is wrong with sections that are neither compressed nor of another size.
  std::string fault() {
    entry_.checksum = checksumOf(kKey, entry_, sections_);
    return fault(joined());
  }
  std::string joined() const { return bki_mapping::joined(sections_, last_section_); }
  std::string fault(const std::string& content) {
    return codec_.unpack(kKey, entry_, reinterpret_cast<const unsigned char*>(content.data()),
                         content.size());
  }
  void expectReadAsWritten(const SemanticMap& map) {
    entry_ = codec_.pack(map, kKey);
    const std::string packed = codec_.packed();
    ASSERT_EQ(fault(packed), "");
    SemanticMap copy = infoOf().emptyMap();
    codec_.addTo(copy, kKey);
    EXPECT_TRUE(reference::contentOf(copy) == reference::contentOf(map));
  }
  /// Packs and unpacks a tile whose blocks have as many looks as there can be, or none.
  void keepsAllLooks() {
    SemanticMap map = infoOf().emptyMap();
    Look::Voxels some, other;
    some[77] = other[78] = other[500] = true;
    constexpr std::uint64_t kLatest = Look::tickOf(~std::uint64_t{0});
    for (const int x : {16, 18}) {
      Block& block = map.getOrAllocate({{x, -8, 0}});
      block.setOcclusion(some);
      for (unsigned level = 0; level < 36; ++level) {
        const std::uint64_t interval = kLatest >> level;
        block.looks().add(Look(interval << level, some, other, {}));
        block.looks().add(Look((interval - 1) << level, some, some, level == 7 ? other : Look::Voxels()));
      }
      EXPECT_GT(block.looks().size(), 36u);
      EXPECT_LE(block.looks().size(), 2 * 36u);
      some = ~some;
    }
    map.getOrAllocate({{17, -8, 0}}).setOcclusion(other);
    expectReadAsWritten(map);
  }

  const TileKey kKey{{2, -1, 0}, 3};
  TileCodec codec_;
  std::size_t last_section_;
  Sections sections_;
  TileEntry entry_{kKey.index, 2, 2, 0};
};

TEST_F(TileCodecTest, ReadsWhatIsSpecified) {
  ASSERT_EQ(fault(), "");
  SemanticMap map = infoOf().emptyMap();
  codec_.addTo(map, kKey);
  ASSERT_EQ(map.size(), 2u);
  const Block &first = *map.find({{16, -8, 0}}), &last = *map.find({{23, -1, 7}});
  EXPECT_TRUE(first.classes().empty());
  EXPECT_EQ(first.occlusion().count(), 2u);
  EXPECT_TRUE(first.occlusion()[40] && first.occlusion()[41]);
  EXPECT_TRUE(last.occlusion().none());
  EXPECT_EQ(last.classes(), (ClassList{40, kFreeClass}));
  for (std::size_t v = 0; v < kBlockVoxels; ++v) {
    ASSERT_EQ(last.plane(0)[v], v == 8 ? 1 : 0) << v;
    ASSERT_EQ(last.plane(1)[v], v == 8 ? -1 : 0) << v;
  }
}

TEST_F(TileCodecTest, WritesWhatIsSpecified) {
  SemanticMap map = infoOf().emptyMap();
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  plane[8] = 1;
  map.getOrAllocate({{23, -1, 7}}).add(40, plane.data());
  plane[8] = -1;
  map.getOrAllocate({{23, -1, 7}}).add(kFreeClass, plane.data());
  Block::Occlusion marks;
  marks[40] = marks[41] = true;
  map.getOrAllocate({{16, -8, 0}}).setOcclusion(marks);
  map.getOrAllocate({{16, -8, 1}});  // without content
  const TileEntry entry = codec_.pack(map, kKey);
  EXPECT_EQ(entry.blocks, 2);
  EXPECT_EQ(entry.planes, 2);
  EXPECT_EQ(entry.checksum, checksumOf(kKey, entry, sections_));
  const std::string packed = codec_.packed();
  EXPECT_EQ(packed.substr(24, sections_[0].size()), sections_[0]);
  EXPECT_EQ(fault(packed), "its checksum is wrong");
  entry_ = entry;
  EXPECT_EQ(fault(packed), "");
}

TEST_F(TileCodecTest, RefusesAnythingElse) {
  const Sections good = sections_;
  const auto with = [&](std::size_t section, std::size_t position, char byte) {
    sections_ = good;
    sections_[section][position] = byte;
    return fault();
  };
  EXPECT_EQ(with(0, 3, '\2'), "its blocks are out of order");  // 767
  EXPECT_EQ(with(0, 1, '\2'), "its blocks are out of order");
  EXPECT_EQ(with(0, 6, '\0'), "a block is empty");
  EXPECT_EQ(with(0, 6, '\2'), "a block is empty");
  EXPECT_EQ(with(0, 5, '\3'), "planes are missing");
  EXPECT_EQ(with(0, 5, '\1'), "planes are left over");
  EXPECT_EQ(with(0, 8, '\xff'), "its planes are out of order");
  EXPECT_EQ(with(0, 8, '\x29'), "it has a class that is not in the class table");
  EXPECT_EQ(with(1, 5, '\0'), "a plane is empty");
  EXPECT_EQ(with(1, 65, '\0'), "a plane is empty");
  EXPECT_EQ(with(1, 65, '\3'), "it cannot be decompressed");
  EXPECT_EQ(with(2, 0, '\0'), "a value is out of range");
  sections_ = good;
  sections_[2][0] = '\0';
  sections_[5][0] = '\x80';
  EXPECT_EQ(fault(), "a value is out of range");
  for (std::size_t section = 0; section < 6; ++section) {
    sections_ = good;
    sections_[section].pop_back();
    EXPECT_NE(fault(), "") << section;
    sections_[section] = good[section] + '\0';
    EXPECT_EQ(fault(), "a length is wrong") << section;
  }
  sections_ = good;
  entry_.blocks = 0;
  EXPECT_EQ(fault(), "a count is wrong");
  entry_.blocks = 2;
  entry_.planes = std::numeric_limits<int>::max();
  EXPECT_EQ(fault(), "a length is wrong");
  entry_.planes = 2;
  ASSERT_EQ(fault(), "");
  EXPECT_EQ(fault(joined() + "x"), "bytes are left over");
  EXPECT_EQ(fault(joined().substr(0, 23)), "it is too short");
  EXPECT_EQ(fault(joined().substr(0, 200)), "a length is wrong");
}

TEST_F(TileCodecTest, RefusesStreamsOfAnotherSize) {
  const Sections good = sections_;
  sections_[1] = deflated(good[1]);
  ASSERT_LT(sections_[1].size(), good[1].size());
  entry_.checksum = checksumOf(kKey, entry_, good);
  EXPECT_EQ(fault(joined()), "");
  const std::string streams[] = {deflated(good[1] + "x"), deflated(good[1].substr(1)), sections_[1] + "x",
                                 sections_[1].substr(0, sections_[1].size() - 1), std::string(50, 'x')};
  for (const std::string& stream : streams) {
    sections_[1] = stream;
    EXPECT_EQ(fault(joined()), "it cannot be decompressed") << stream.size();
  }
}

/// The sections of versions 3 and 4 with two looks at block 511, in ticks 0x0102030000 to 0x010203ffff (level
/// 16), and 0x0102048765.
class LooksInTile : public TileCodecTest {
 protected:
  LooksInTile() : TileCodecTest(TileLayout::kLookMasks) {
    sections_[0] = std::string("\0\0\xff\1\0\2\1\4", 8) + "\x28\xff" + std::string("\x10\0", 2);
    std::string& looks = sections_[6];
    looks = std::string("\0\0\3\2\1\0\0\0", 8) + std::string("\x65\x87\4\2\1\0\0\0", 8);
    looks.resize(kMasks + 4 * 64);
    looks[kMasks + 1] = '\3';       // voxels 8 and 9: the low bits of the first look
    looks[kMasks + 64 + 1] = '\6';  // voxels 9 and 10: its high bits
    looks[kMasks + 128 + 63] = '\x80';
  }
  std::string faultWith(std::size_t section, std::size_t position, const std::string& bytes) {
    const Sections good = sections_;
    sections_[section].replace(position, bytes.size(), bytes);
    const std::string found = fault();
    sections_ = good;
    return found;
  }

  static constexpr std::size_t kMasks = 2 * 8;
};

TEST_F(LooksInTile, AreReadAsSpecified) {
  ASSERT_EQ(fault(), "");
  SemanticMap map = infoOf().emptyMap();
  codec_.addTo(map, kKey);
  EXPECT_TRUE(map.find({{16, -8, 0}})->looks().empty());
  EXPECT_EQ(map.find({{16, -8, 0}})->occlusion().count(), 2u);
  const std::vector<Look>& looks = map.find({{23, -1, 7}})->looks().all();
  ASSERT_EQ(looks.size(), 2u);
  EXPECT_EQ(looks[0].begin(), 0x0102030000u);
  EXPECT_EQ(looks[0].level(), 16u);
  EXPECT_EQ(looks[1].begin(), 0x0102048765u);
  EXPECT_EQ(looks[1].level(), 0u);
  for (std::size_t v = 0; v < kBlockVoxels; ++v) {
    const Sight first = v == 8    ? Sight::kCrossed
                        : v == 9  ? Sight::kHit
                        : v == 10 ? Sight::kVoid
                                  : Sight::kNothing;
    ASSERT_EQ(looks[0].at(v), first) << v;
    ASSERT_EQ(looks[1].at(v), v == 511 ? Sight::kCrossed : Sight::kNothing) << v;
  }
  codec_.addTo(map, kKey);  // the same again
  EXPECT_EQ(map.find({{23, -1, 7}})->looks().all(), looks);
}

TEST_F(LooksInTile, AreWrittenAsSpecified) {
  ASSERT_EQ(fault(), "");
  SemanticMap map = infoOf().emptyMap();
  codec_.addTo(map, kKey);
  const TileEntry entry = codec_.pack(map, kKey);
  EXPECT_EQ(entry.blocks, 2);
  EXPECT_EQ(entry.planes, 2);
  EXPECT_EQ(entry.checksum, checksumOf(kKey, entry, sections_));
  const std::string packed = codec_.packed();
  EXPECT_EQ(packed.substr(24, sections_[0].size()), sections_[0]);
  entry_ = entry;
  EXPECT_EQ(fault(packed), "");
  // Where they are not kept, the tile is as if the map had none.
  sections_[0][7] = '\0';
  sections_[0].resize(10);
  sections_[6].clear();
  TileCodec without(*infoOf().classes, TileLayout::kNoLooks);
  EXPECT_EQ(without.pack(map, kKey).checksum, checksumOf(kKey, entry, sections_));
  for (const auto& [index, block] : sortedBlocks(map)) map.getOrAllocate(index).looks().clear();
  EXPECT_TRUE(codec_.pack(map, kKey) == without.pack(map, kKey));
  EXPECT_TRUE(codec_.packed() == without.packed());
}

TEST_F(LooksInTile, AreAllKept) {
  keepsAllLooks();
}

TEST_F(LooksInTile, StayReadableWhenABoxIsCleared) {
  ASSERT_EQ(fault(), "");
  SemanticMap map = infoOf().emptyMap();
  codec_.addTo(map, kKey);
  const BlockIndex index{{23, -1, 7}};
  Look::Voxels cleared;
  cleared[511] = true;  // all that the latest look has seen
  map.getOrAllocate(index).looks().erase(cleared);
  EXPECT_EQ(map.find(index)->looks().all().size(), 2u)
      << "without the latest, the other would have a wrong level";
  expectReadAsWritten(map);
  cleared.set();
  map.getOrAllocate(index).looks().erase(cleared);
  EXPECT_TRUE(map.find(index)->looks().empty());
}

TEST_F(LooksInTile, AreRefusedIfNoMapWritesThem) {
  ASSERT_EQ(fault(), "");
  const std::string wrong = "its looks are wrong";
  EXPECT_EQ(faultWith(0, 10, "\x0f"), wrong) << "finer than its age demands";
  EXPECT_EQ(faultWith(0, 10, "\x11"), wrong) << "coarser";
  EXPECT_EQ(faultWith(0, 10, "\xff"), wrong) << "longer than time";
  EXPECT_EQ(faultWith(0, 11, "\1"), wrong) << "the latest is longer than a tick";
  EXPECT_EQ(faultWith(6, 0, "\1"), wrong) << "begins at no multiple of its length";
  EXPECT_EQ(faultWith(6, 0, sections_[6].substr(8, 8)), wrong) << "twice the same time";
  EXPECT_EQ(faultWith(6, 0, sections_[6].substr(8, 8) + sections_[6].substr(0, 8)), wrong) << "out of order";
  EXPECT_EQ(faultWith(6, 15, "\1"), wrong) << "beyond all stamps";
  EXPECT_EQ(faultWith(6, 8, std::string(8, '\xff')), wrong) << "likewise";
  EXPECT_EQ(faultWith(6, 0, std::string(8, '\xff')), wrong) << "and before it";
  EXPECT_EQ(faultWith(6, kMasks, std::string(128, '\0')), wrong) << "one that has seen nothing";
  EXPECT_EQ(faultWith(6, kMasks + 128, std::string(128, '\0')), "")
      << "the latest gives the others their levels";
  EXPECT_EQ(faultWith(6, kMasks, std::string(256, '\0')), wrong);
}

TEST_F(LooksInTile, AreRefusedInOtherNumbers) {
  const Sections good = sections_;
  const std::string other_number = "it has another number of looks";
  EXPECT_EQ(faultWith(0, 7, "\2"), other_number);
  EXPECT_EQ(faultWith(0, 7, "\6"), other_number);
  EXPECT_EQ(faultWith(0, 7, "\xfe"), other_number);
  sections_[0].resize(10);
  EXPECT_EQ(fault(), other_number);
  sections_[0] = good[0] + '\0';
  EXPECT_EQ(fault(), other_number);
  sections_[0] = good[0] + std::string(1000, '\0');
  EXPECT_EQ(fault(), "a length is wrong");
  // Planes instead of looks: there is no evidence for them.
  sections_ = good;
  sections_[0][7] = '\0';
  sections_[0][5] = '\3';
  sections_[0].replace(8, 4, std::string("\0\x28\x50\xff", 4));
  entry_.planes = 3;
  EXPECT_EQ(fault(), other_number);
  sections_[0][5] = '\4';
  EXPECT_EQ(fault(), "planes are missing");
  entry_.planes = 2;
  EXPECT_EQ(fault(), "planes are missing");
  // The section is cut off, or goes on.
  sections_ = good;
  sections_[6].pop_back();
  EXPECT_EQ(fault(), "it cannot be decompressed");
  sections_[6] += "xx";
  EXPECT_EQ(fault(), "a length is wrong");
  sections_[6].clear();
  EXPECT_EQ(fault(), "it is too short");
  sections_ = good;
  EXPECT_EQ(fault(joined() + "x"), "bytes are left over");
  EXPECT_EQ(fault(joined().substr(0, joined().size() - 1)), "a length is wrong");
  sections_[0][7] = '\0';
  sections_[0].resize(10);
  EXPECT_EQ(fault(), "bytes are left over");
  sections_ = good;
  ASSERT_EQ(fault(), "");
  const std::string content = joined();
  for (const std::size_t end : {content.size() - good[6].size() - 1, content.size() - good[6].size() - 4}) {
    EXPECT_EQ(fault(content.substr(0, end)), "it is too short") << end;
  }
  sections_[6][kMasks + 2] = '\1';
  EXPECT_EQ(fault(joined()), "its checksum is wrong");
}

TEST_F(LooksInTile, AreRefusedInFilesThatKeepNone) {
  entry_.checksum = checksumOf(kKey, entry_, sections_);
  const std::string content = joined();
  TileCodec codec(*infoOf().classes, TileLayout::kNoLooks);
  EXPECT_EQ(
      codec.unpack(kKey, entry_, reinterpret_cast<const unsigned char*>(content.data()), content.size()),
      "a flag is not known");
}

// Whoever claims much must send much.
TEST_F(LooksInTile, TakeNoMemoryForClaims) {
  std::string numbers;
  for (int b = 0; b < 512; ++b) numbers += {static_cast<char>(b & 0xff), static_cast<char>(b >> 8)};
  sections_[0] = numbers + std::string(512, '\0') + std::string(512, '\xff') + std::string(127 * 512, '\0');
  sections_[1] = std::string(512 * 64, '\xff');
  for (std::size_t section = 2; section < 6; ++section) sections_[section].clear();
  sections_[6] = "x";
  entry_ = {kKey.index, 512, 0, 0};
  const std::string content = joined();
  {
    const PeakMemory memory;
    EXPECT_EQ(fault(content), "a length is wrong");
    EXPECT_LT(memory.bytes(), 300'000);
  }
  sections_[6] = deflated(std::string(127 * 512 * 136, '\0'));
  const std::string zeros = joined();
  const PeakMemory memory;
  EXPECT_EQ(fault(zeros), "its checksum is wrong");
  EXPECT_LT(memory.bytes(), static_cast<std::ptrdiff_t>(500'000 + TileCodec::kMemoryPerByte * zeros.size()));
}

/// The same looks without the rows that nobody saw.
class LookRowsInTile : public TileCodecTest {
 protected:
  LookRowsInTile() {
    sections_[0] = std::string("\0\0\xff\1\0\2\1\4", 8) + "\x28\xff";
    sections_[6] = std::string("\x65\x87\4\2\1\0\0\0", 8)  // the latest
                   + std::string("\2\0\0\0\0\0\0\x80", 8)  // rows 1 and 63 were seen
                   + std::string("\2\0\0\0\0\0\0\0", 8)    // row 1 was hit
                   + std::string("\x21\0", 2);             // level 16, the interval before; and the latest
    sections_[7] = std::string("\7\0\0\x80", 4);           // voxels 8 to 10, and voxel 511
    sections_[8] = std::string("\4\0", 2);                 // voxel 10
    sections_[9] = "\2";                                   // voxel 9
  }
  std::string faultWith(std::size_t section, std::size_t position, const std::string& bytes) {
    const Sections good = sections_;
    sections_[section].replace(position, bytes.size(), bytes);
    const std::string found = fault();
    sections_ = good;
    return found;
  }
};

TEST_F(LookRowsInTile, AreReadAsSpecified) {
  ASSERT_EQ(fault(), "");
  SemanticMap map = infoOf().emptyMap();
  codec_.addTo(map, kKey);
  EXPECT_TRUE(map.find({{16, -8, 0}})->looks().empty());
  EXPECT_EQ(map.find({{16, -8, 0}})->occlusion().count(), 2u);
  Look::Voxels crossed, voids, hit, last;
  crossed[8] = hit[9] = voids[10] = last[511] = true;
  const std::vector<Look> expected = {Look(0x0102030000u, 16, crossed | hit, voids | hit),
                                      Look(0x0102048765u, last, {}, {})};
  EXPECT_EQ(map.find({{23, -1, 7}})->looks().all(), expected);
  codec_.addTo(map, kKey);  // the same again
  EXPECT_EQ(map.find({{23, -1, 7}})->looks().all(), expected);
}

TEST_F(LookRowsInTile, AreWrittenAsSpecified) {
  ASSERT_EQ(fault(), "");
  SemanticMap map = infoOf().emptyMap();
  codec_.addTo(map, kKey);
  const TileEntry entry = codec_.pack(map, kKey);
  EXPECT_EQ(entry.checksum, checksumOf(kKey, entry, sections_));
  const std::string packed = codec_.packed();
  entry_ = entry;
  EXPECT_EQ(fault(packed), "");
  sections_[0][7] = '\0';
  for (std::size_t section = 6; section < sections_.size(); ++section) sections_[section].clear();
  TileCodec without(*infoOf().classes, TileLayout::kNoLooks);
  EXPECT_EQ(without.pack(map, kKey).checksum, checksumOf(kKey, entry, sections_));
}

TEST_F(LookRowsInTile, AreAllKept) {
  keepsAllLooks();
}

TEST_F(LookRowsInTile, AreRefusedIfNoMapWritesThem) {
  ASSERT_EQ(fault(), "");
  const std::string wrong = "its looks are wrong", length = "a length is wrong";
  EXPECT_EQ(faultWith(6, 24, "\x20"), wrong) << "coarser than its age demands";
  EXPECT_EQ(faultWith(6, 24, "\x7e"), wrong) << "longer than time";
  EXPECT_EQ(faultWith(6, 24, "\xff"), wrong) << "likewise";
  EXPECT_EQ(faultWith(6, 24, std::string(1, '\0')), wrong) << "twice the same time";
  EXPECT_EQ(faultWith(6, 25, "\1"), wrong) << "not the latest";
  EXPECT_EQ(faultWith(6, 25, "\2"), wrong) << "the latest is longer than a tick";
  EXPECT_EQ(faultWith(6, 24, std::string("\0\x21", 2)), wrong) << "out of order";
  EXPECT_EQ(faultWith(6, 0, std::string(8, '\xff')), wrong) << "beyond all stamps";
  EXPECT_EQ(faultWith(6, 0, std::string(8, '\0')), wrong) << "the other is before all stamps";
  EXPECT_EQ(faultWith(6, 8, "\3"), "it cannot be decompressed") << "another row was seen";
  EXPECT_EQ(faultWith(6, 16, "\3"), wrong) << "a row that nobody saw was hit";
  EXPECT_EQ(faultWith(6, 16, std::string(1, '\0')), length) << "none was hit";
  EXPECT_EQ(faultWith(7, 0, std::string(1, '\0')), length) << "no row of the first was seen";
  EXPECT_EQ(faultWith(7, 0, "\3"), wrong) << "void and not seen";
  EXPECT_EQ(faultWith(7, 0, "\5"), wrong) << "hit and not seen";
  EXPECT_EQ(faultWith(8, 0, "\6"), wrong) << "hit and void";
  EXPECT_EQ(faultWith(9, 0, std::string(1, '\0')), wrong) << "nothing was hit";
  // Rows that no look has seen.
  const Sections good = sections_;
  sections_[6][8] = '\6';
  sections_[7] = std::string("\7\0\0\0\0\x80", 6);
  EXPECT_EQ(fault(), wrong);
  sections_ = good;
  sections_[6][16 + 7] = '\x80';
  sections_[9] = std::string("\2\0", 2);
  EXPECT_EQ(fault(), wrong);
}

TEST_F(LookRowsInTile, AreRefusedInOtherNumbers) {
  const Sections good = sections_;
  EXPECT_NE(faultWith(0, 7, "\2"), "");
  EXPECT_EQ(faultWith(0, 7, "\6"), "it cannot be decompressed");
  sections_[0] += '\0';
  EXPECT_EQ(fault(), "a length is wrong") << "versions 3 and 4 have levels there";
  for (std::size_t section = 6; section < sections_.size(); ++section) {
    sections_ = good;
    sections_[section] += "x";
    EXPECT_EQ(fault(), "a length is wrong") << section;
    sections_[section] = good[section].substr(1);
    EXPECT_NE(fault(), "") << section;
  }
  sections_ = good;
  entry_.checksum = checksumOf(kKey, entry_, sections_);
  const std::string content = joined();
  EXPECT_EQ(fault(content), "");
  EXPECT_EQ(fault(content + "x"), "bytes are left over");
  std::size_t end = content.size();
  for (std::size_t section = 9; section >= 6; --section) {
    end -= good[section].size();
    EXPECT_EQ(fault(content.substr(0, end - 1)), "it is too short") << section;
    end -= 4;
    EXPECT_EQ(fault(content.substr(0, end)), "it is too short") << section;
  }
  sections_[8][1] = '\x80';
  EXPECT_EQ(fault(joined()), "its checksum is wrong");
}

// Whoever claims much must send much.
TEST_F(LookRowsInTile, TakeNoMemoryForClaims) {
  std::string numbers, heads;
  for (int b = 0; b < 512; ++b) numbers += {static_cast<char>(b & 0xff), static_cast<char>(b >> 8)};
  sections_[0] = numbers + std::string(512, '\0') + std::string(512, '\xff');
  sections_[1] = std::string(512 * 64, '\xff');
  for (std::size_t section = 2; section < 6; ++section) sections_[section].clear();
  sections_[6] = deflated(std::string(512 * 24 + 127 * 512, '\xff'));
  sections_[7] = "x";
  entry_ = {kKey.index, 512, 0, 0};
  const std::string content = joined();
  {
    const PeakMemory memory;
    EXPECT_EQ(fault(content), "a length is wrong");
    EXPECT_LT(memory.bytes(), 400'000);
  }
  sections_[7] = sections_[8] = sections_[9] = deflated(std::string(127 * 512 * 64, '\xff'));
  const std::string ones = joined();
  const PeakMemory memory;
  EXPECT_EQ(fault(ones), "its checksum is wrong");
  EXPECT_LT(memory.bytes(), static_cast<std::ptrdiff_t>(500'000 + TileCodec::kMemoryPerByte * ones.size()));
}

// Whoever claims much must send much.
TEST_F(TileCodecTest, TakesNoMemoryForClaims) {
  std::string numbers, counts(512, '\3');
  for (int b = 0; b < 512; ++b) numbers += {static_cast<char>(b & 0xff), static_cast<char>(b >> 8)};
  sections_[0] = numbers + counts + std::string(512, '\0');
  for (int b = 0; b < 512; ++b) sections_[0] += std::string("\0\x28\x50", 3);
  sections_[1] = deflated(std::string(1536 * 64, '\xff'));
  for (std::size_t section = 2; section < 6; ++section) sections_[section] = "x";
  entry_ = {kKey.index, 512, 1536, 0};
  const std::string content = joined();
  const PeakMemory memory;
  EXPECT_EQ(fault(content), "a length is wrong");
  EXPECT_LT(memory.bytes(), 200'000);
}

/// Blocks 1 and 511, each with values of class 40, two and one, in multiples of 1000, and of `free`, three
/// and two, in multiples of 1000 and 7.
class StepsInTile : public testing::Test {
 protected:
  using Parts = std::vector<std::string>;

  StepsInTile() {
    std::string masks(4 * 64, '\0');
    masks[0] = '\3';
    masks[64 + 63] = '\7';  // voxels 504 to 506
    masks[2 * 64] = '\4';
    masks[3 * 64 + 63] = '\x18';  // voxels 507 and 508
    parts_ = {std::string("\1\0\xff\1\2\2\0\0", 8) + "\x28\xff\x28\xff",
              masks,
              std::string("\2\1\0\0\xfe", 5),  // 2, 3, 3, 3, 1 times 1000
              std::string("\0\1\1\0\0", 5),    // 0, 1, 2, 2, 2 times 256 times 1000
              std::string("\0\5\0\0\1", 5),    // 0, 5, 5, 5, 6 times 7
              std::string("\0\0\3\0\0", 5),    // 0, 0, 3, 0, 0
              std::string("\1\0\2", 3),        // 1, 1, 3 times 1000
              std::string("\xff\1\0", 3),
              std::string("\xff\0\0", 3),
              std::string("\xff\0\0", 3),
              std::string("\xff\0\0", 3)};
  }
  std::string joined() const {
    std::string head;
    const auto append = [&](std::size_t number) {
      for (unsigned shift = 0; shift < 32; shift += 8) head += static_cast<char>(number >> shift & 0xff);
    };
    append(parts_[0].size());
    append(parts_[1].size());
    for (const std::size_t step : {1000, 7, 1000, 0}) append(step);
    append(present_);
    std::string content = parts_[0] + parts_[1];
    for (std::size_t n = 2; n < parts_.size(); ++n) {
      append(parts_[n].size());
      content += parts_[n];
    }
    return head + content;
  }
  std::string fault(const std::string& content) {
    return codec_.unpack(kKey, entry_, reinterpret_cast<const unsigned char*>(content.data()),
                         content.size());
  }
  std::string fault() { return fault(joined()); }
  /// What the sections hold, as before version 6, whose checksum is the same.
  std::uint32_t checksum() const {
    Sections sections;
    sections[0] = parts_[0];
    sections[1] = parts_[1];
    for (const EvidenceUnits units :
         {kOther[0], kOther[1], kFree[0], kFree[1], kFree[2], kOther[2], kFree[3], kFree[4]}) {
      for (unsigned byte = 0; byte < 4; ++byte) {
        sections[2 + byte] += static_cast<char>(static_cast<std::uint32_t>(units) >> 8 * byte);
      }
    }
    return checksumOf(kKey, entry_, sections);
  }

  const std::vector<EvidenceUnits> kOther = {999, 1001, 3000}, kFree = {2000, 259035, 515038, 515035, 513042};
  const TileKey kKey{{2, -1, 0}, 3};
  TileCodec codec_{*infoOf().classes};
  std::size_t present_ = 1u << 0 | 1u << 1 | 1u << 4 | 1u << 8 | 1u << 12 | 0xfu << 20;
  Parts parts_;
  TileEntry entry_{kKey.index, 2, 4, 0};
};

TEST_F(StepsInTile, AreReadAsSpecified) {
  entry_.checksum = checksum();
  ASSERT_EQ(fault(), "");
  SemanticMap map = infoOf().emptyMap();
  codec_.addTo(map, kKey);
  ASSERT_EQ(map.size(), 2u);
  const Block &first = *map.find({{17, -8, 0}}), &last = *map.find({{23, -1, 7}});
  ASSERT_EQ(first.classes(), (ClassList{40, kFreeClass}));
  ASSERT_EQ(last.classes(), first.classes());
  for (std::size_t v = 0; v < kBlockVoxels; ++v) {
    ASSERT_EQ(first.plane(0)[v], v < 2 ? kOther[v] : 0) << v;
    ASSERT_EQ(first.plane(1)[v], v >= 504 && v < 507 ? kFree[v - 504] : 0) << v;
    ASSERT_EQ(last.plane(0)[v], v == 2 ? kOther[v] : 0) << v;
    ASSERT_EQ(last.plane(1)[v], v >= 507 && v < 509 ? kFree[v - 504] : 0) << v;
  }
}

TEST_F(StepsInTile, AreRefusedIfSomethingIsWrong) {
  entry_.checksum = checksum();
  const Parts good = parts_;
  for (std::size_t n = 0; n < parts_.size(); ++n) {
    parts_ = good;
    parts_[n].pop_back();
    EXPECT_NE(fault(), "") << n;
    parts_[n] = good[n] + 'x';
    EXPECT_EQ(fault(), "a length is wrong") << n;
    if (n < 2) continue;
    parts_[n] = good[n];
    parts_[n][1] = static_cast<char>(parts_[n][1] + 1);
    EXPECT_EQ(fault(), "its checksum is wrong") << n;
  }
  parts_ = good;
  EXPECT_EQ(fault(joined() + "x"), "bytes are left over");
  for (const std::size_t end : {0, 27, 28, 28 + 4 * 9 - 1}) {
    EXPECT_EQ(fault(joined().substr(0, end)), "it is too short") << end;
  }
  present_ |= 1u << 24;
  EXPECT_EQ(fault(), "a section is not known");
  present_ = 1;
  parts_.resize(3);
  EXPECT_EQ(fault(), "a value is out of range") << "all of class 40 are 0";
}

// Whoever claims much must send much: here, as many planes in a block as there can be.
TEST_F(StepsInTile, TakeNoMemoryForClaims) {
  std::vector<SemanticClass> classes(254);
  for (std::size_t id = 0; id < classes.size(); ++id) {
    classes[id].id = static_cast<ClassId>(id);
    classes[id].name = std::to_string(id);
    classes[id].unlabelled = classes[id].any_raw = id == 0;
    if (id > 0) classes[id].raw = {static_cast<std::uint32_t>(id)};
  }
  TileCodec codec(ClassTable("all", classes));
  constexpr std::size_t kBlocks = 64, kPlanes = 255 * kBlocks;
  std::string numbers, of_classes, of_block;
  for (std::size_t id = 0; id < classes.size(); ++id) of_block += static_cast<char>(id);
  of_block += '\xff';
  for (std::size_t b = 0; b < kBlocks; ++b) {
    numbers += {static_cast<char>(b & 0xff), static_cast<char>(b >> 8)};
    of_classes += of_block;
  }
  const Parts head = {numbers + std::string(kBlocks, '\xff') + std::string(kBlocks, '\0') + of_classes,
                      deflated(std::string(kPlanes * 64, '\xff'))};
  const std::string free = deflated(std::string(kBlocks * kBlockVoxels, '\1')),
                    other = deflated(std::string((kPlanes - kBlocks) * kBlockVoxels, '\1'));
  entry_ = {kKey.index, kBlocks, kPlanes, 0};
  for (const std::size_t of_each : {0u, 1u, 2u}) {
    parts_ = head;
    parts_.insert(parts_.end(), of_each, free);
    parts_.insert(parts_.end(), of_each, other);
    present_ = ((1u << of_each) - 1) * (1u + (1u << 12));
    const std::string content = joined();
    const PeakMemory memory;
    EXPECT_EQ(
        codec.unpack(kKey, entry_, reinterpret_cast<const unsigned char*>(content.data()), content.size()),
        of_each == 0 ? "a value is out of range" : "its checksum is wrong");
    EXPECT_LT(memory.bytes(),
              static_cast<std::ptrdiff_t>(500'000 + TileCodec::kMemoryPerByte * content.size()))
        << of_each;
  }
}

// Most evidence with rules is a sum of what scans add.
TEST_F(StepsInTile, AreThoseOfTheRulesIfTheyFit) {
  SemanticMap map = infoOf().emptyMap();
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  Block& block = map.getOrAllocate({{16, -8, 0}});
  const auto add = [&](ClassId id, auto&& units_of) {
    for (std::size_t v = 0; v < plane.size(); ++v) plane[v] = units_of(static_cast<int>(v));
    block.add(id, plane.data());
  };
  const auto expectHead = [&](const std::vector<std::uint32_t>& steps, std::uint32_t present) {
    entry_ = codec_.pack(map, kKey);
    const std::string packed = codec_.packed();
    EXPECT_EQ(fault(packed), "");
    SemanticMap copy = infoOf().emptyMap();
    codec_.addTo(copy, kKey);
    EXPECT_TRUE(reference::contentOf(copy) == reference::contentOf(map));
    std::vector<std::uint32_t> head(5);
    std::memcpy(head.data(), packed.data() + 8, 20);
    EXPECT_EQ(head.back(), present);
    head.pop_back();
    EXPECT_EQ(head, steps);
    return packed.size();
  };
  constexpr std::uint32_t kRestOfFree = 1u << 8, kRestOfOther = 1u << 20;
  add(40, [](int v) { return 1278 * (v % 5); });
  expectHead({38339, 98, 1278, 0}, 1u << 12);
  add(kFreeClass, [](int v) { return 38339 * (v % 3) + 98 * (v % 7); });
  const std::size_t size = expectHead({38339, 98, 1278, 0}, 1u << 12 | 1u << 4 | 1u);
  TileCodec before(*infoOf().classes, TileLayout::kLookRows);
  EXPECT_EQ(before.pack(map, kKey).checksum, entry_.checksum) << "does not depend on the layout";
  EXPECT_LT(size, before.packed().size() / 2);
  add(40, [](int v) { return v % 2; });
  expectHead({38339, 98, 1278, 0}, kRestOfOther | 1u << 12 | 1u << 4 | 1u);
  add(kFreeClass, [](int) { return 5; });
  expectHead({0, 0, 1278, 0}, kRestOfOther | 1u << 12 | 7 * kRestOfFree);
}

TEST_F(StepsInTile, AreThoseOfTheSettingsOfTheFile) {
  SemanticMap map = infoOf().emptyMap();
  std::vector<EvidenceUnits> plane(kBlockVoxels);
  for (std::size_t v = 0; v < plane.size(); ++v) plane[v] = 3834 * static_cast<int>(1 + v % 20);
  map.getOrAllocate({{16, -8, 0}}).add(kFreeClass, plane.data());
  codec_.setRules(rulesOfParameters("rules: {enabled: true, void_outweighs: 3}"));
  codec_.pack(map, kKey);
  EXPECT_EQ(codec_.packed().substr(8, 2), "\xfa\x0e") << "3834 = 0x0efa";
  for (const std::string parameters :
       {"", "rules: {stands_after: 2}", "rules: {void_outweighs: -1}", ": no: YAML ]"}) {
    EXPECT_EQ(rulesOfParameters(parameters).void_outweighs, RulesConfig().void_outweighs) << parameters;
  }
}

TEST(EvidenceSections, HoldAnyValuesInAnySteps) {
  std::mt19937 random(1);
  const auto below = [&](std::size_t limit) { return static_cast<std::size_t>(random() % limit); };
  const auto draw = [&] {
    const auto bits = static_cast<std::uint32_t>(random());
    return bits >> below(32);
  };
  for (int round = 0; round < 200; ++round) {
    EvidenceSections::Planes planes(below(5));
    EvidenceSections::Values values;
    for (EvidenceSections::Plane& plane : planes) {
      plane = {below(2) == 0 ? EvidenceSections::kFree : EvidenceSections::kOther, below(9)};
      for (std::size_t v = 0; v < plane.values; ++v) values.push_back(draw());
    }
    EvidenceSections::StepsOfKinds steps;
    for (EvidenceSteps& each : steps) {
      each.a = draw();
      each.b = below(2) == 0 ? 0 : draw();
    }
    std::array<std::string, EvidenceSections::kSections> sections;
    EvidenceSections::split(planes, values, steps, sections.data());
    EvidenceSections::Values sum(values.size());
    for (std::size_t section = 0; section < sections.size(); ++section) {
      if (!sections[section].empty()) EvidenceSections::add(section, sections[section], planes, steps, sum);
    }
    ASSERT_EQ(sum, values) << round;
  }
}

}  // namespace
}  // namespace bki_mapping
