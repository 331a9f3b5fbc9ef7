// The content of a tile, as it is specified; and as it must not be.
#include "store/tile_codec.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <array>
#include <limits>

#include "reference/content.h"
#include "store/counted_memory.h"
#include "store/map_maker.h"

namespace bki_mapping {
namespace {

using Sections = std::array<std::string, 6>;

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
            bytes.size(), 9);
  packed.resize(size);
  return packed;
}

std::string joined(const Sections& sections) {
  std::string content;
  for (const std::string& section : sections) {
    for (unsigned shift = 0; shift < 32; shift += 8) content += static_cast<char>(section.size() >> shift);
  }
  for (const std::string& section : sections) content += section;
  return content;
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
  TileCodecTest() {
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
    return fault(joined(sections_));
  }
  std::string fault(const std::string& content) {
    return codec_.unpack(kKey, entry_, reinterpret_cast<const unsigned char*>(content.data()),
                         content.size());
  }

  const TileKey kKey{{2, -1, 0}, 3};
  TileCodec codec_{*infoOf().classes};
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
  EXPECT_EQ(last.classes(), (std::vector<ClassId>{40, kFreeClass}));
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
    sections_[section] += "xx";
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
  EXPECT_EQ(fault(joined(sections_) + "x"), "bytes are left over");
  EXPECT_EQ(fault(joined(sections_).substr(0, 23)), "it is too short");
  EXPECT_EQ(fault(joined(sections_).substr(0, 200)), "a length is wrong");
}

TEST_F(TileCodecTest, RefusesStreamsOfAnotherSize) {
  const Sections good = sections_;
  sections_[1] = deflated(good[1]);
  ASSERT_LT(sections_[1].size(), good[1].size());
  entry_.checksum = checksumOf(kKey, entry_, good);
  EXPECT_EQ(fault(joined(sections_)), "");
  const std::string streams[] = {deflated(good[1] + "x"), deflated(good[1].substr(1)), sections_[1] + "x",
                                 sections_[1].substr(0, sections_[1].size() - 1), std::string(50, 'x')};
  for (const std::string& stream : streams) {
    sections_[1] = stream;
    EXPECT_EQ(fault(joined(sections_)), "it cannot be decompressed") << stream.size();
  }
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
  const std::string content = joined(sections_);
  const PeakMemory memory;
  EXPECT_EQ(fault(content), "a length is wrong");
  EXPECT_LT(memory.bytes(), 200'000);
}

}  // namespace
}  // namespace bki_mapping
