// Any bytes as the content of a tile. Most of them would stumble over lengths and checksums, so the bytes are
// also put into sections that have the right ones. What can be read can be written, and is then the same. Run
// by libFuzzer, or by fuzz_corpus.cpp.
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "store/counted_memory.h"
#include "store/map_maker.h"
#include "store/tile_codec.h"

namespace bki_mapping {
namespace {

void require(bool condition, const std::string& what) {
  if (condition) return;
  std::fprintf(stderr, "%s\n", what.c_str());
  std::abort();
}

/// Bytes that never end: zeros follow.
class Bytes {
 public:
  Bytes(const unsigned char* data, std::size_t size) : next_(data), left_(size) {}

  std::size_t number(std::size_t bytes) {
    std::size_t value = 0;
    for (std::size_t b = 0; b < bytes; ++b) value = value << 8 | static_cast<unsigned char>(string(1)[0]);
    return value;
  }
  std::string string(std::size_t size) {
    std::string text(size, '\0');
    const std::size_t taken = std::min(size, left_);
    std::copy(next_, next_ + taken, text.begin());
    next_ += taken;
    left_ -= taken;
    return text;
  }
  std::string rest() { return string(left_); }

 private:
  const unsigned char* next_;
  std::size_t left_;
};

std::string deflated(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
            bytes.size(), 1);
  packed.resize(size);
  return packed;
}

/// @param compressed a bit for each section. @param[out] checksum of the content, as entry.checksum should
/// be.
std::string framed(Bytes& bytes, const TileKey& key, TileEntry& entry, std::size_t compressed,
                   LooksLayout layout) {
  const auto blocks = static_cast<std::size_t>(entry.blocks), planes = static_cast<std::size_t>(entry.planes);
  std::array<std::string, 10> sections;
  sections[0] = bytes.string(4 * blocks + planes);
  std::size_t marked = 0, looks = 0;
  std::vector<std::size_t> counts;
  for (std::size_t b = 3 * blocks; b < 4 * blocks; ++b) {
    const auto flags = static_cast<unsigned char>(sections[0][b]);
    marked += flags & 1u;
    looks += flags >> 1;
    if (flags > 1) counts.push_back(flags >> 1);
  }
  if (layout == LooksLayout::kMasks) sections[0] += bytes.string(looks);
  sections[1] = bytes.string(64 * (marked + planes));
  std::size_t values = 0;
  for (std::size_t b = 64 * marked; b < sections[1].size(); ++b) {
    values += static_cast<std::size_t>(__builtin_popcount(static_cast<unsigned char>(sections[1][b])));
  }
  for (std::size_t s = 2; s < 6; ++s) sections[s] = bytes.string(values);
  if (layout == LooksLayout::kMasks) {
    sections[6] = bytes.string(looks * (8 + 2 * 64));
  } else {
    const LookRowsReader rows(counts, sections[6], sections[7], sections[8], sections[9]);
    sections[6] = bytes.string(LookRowsReader::bytesOfHeads(counts));
    sections[7] = bytes.string(rows.bytesOfSeen());
    sections[8] = bytes.string(rows.bytesOfVoids());
    sections[9] = bytes.string(rows.bytesOfHits());
  }
  uLong checksum = 0;
  for (const int number : {key.part, key.index.x, key.index.y, key.index.z, entry.blocks, entry.planes}) {
    checksum = crc32(checksum, reinterpret_cast<const Bytef*>(&number), 4);
  }
  std::string head, body;
  for (std::size_t s = 0; s < sections.size(); ++s) {
    std::string& section = sections[s];
    if ((s == 6 && looks == 0) || (s == 7 && layout == LooksLayout::kMasks)) break;
    checksum = crc32_z(checksum, reinterpret_cast<const Bytef*>(section.data()), section.size());
    if (s > 0 && (compressed >> std::min<std::size_t>(s, 6) & 1) != 0) {
      std::string packed = deflated(section);
      if (packed.size() < section.size()) section = std::move(packed);
    }
    std::string& length = s < 6 ? head : body;
    for (unsigned shift = 0; shift < 32; shift += 8) length += static_cast<char>(section.size() >> shift);
    body += section;
  }
  entry.checksum = static_cast<std::uint32_t>(checksum);
  return head + body;
}

void test(const unsigned char* data, std::size_t size, LooksLayout layout) {
  static const MapInfo info = infoOf();
  Bytes bytes(data, size);
  const TileKey key{{-1, 0, 2}, 1};
  const std::size_t kind = bytes.number(1);
  TileEntry entry{key.index};
  const bool is_framed = (kind & 0x80) != 0;
  entry.blocks = static_cast<int>(bytes.number(2) % (is_framed ? 16 : 1024));
  entry.planes = static_cast<int>(bytes.number(3) % (is_framed ? 32 : 1 << 18));
  if (is_framed && entry.blocks == 0) return;
  const std::string content = is_framed ? framed(bytes, key, entry, kind, layout) : bytes.rest();

  const PeakMemory memory;
  TileCodec codec(*info.classes, layout);
  const std::string fault =
      codec.unpack(key, entry, reinterpret_cast<const unsigned char*>(content.data()), content.size());
  require(memory.bytes() < static_cast<std::ptrdiff_t>(500'000 + TileCodec::kMemoryPerByte * content.size()),
          std::to_string(memory.bytes()) + " bytes of memory for " + std::to_string(content.size()));
  if (!fault.empty()) return;
  SemanticMap map = info.emptyMap(), sum = randomMap(1, 5, 2);
  codec.addTo(map, key);
  codec.addTo(sum, key);
  const TileEntry again = codec.pack(map, key);
  require(again == entry, "a tile that was read is written as another one");
  const std::string packed = codec.packed();
  require(
      codec.unpack(key, again, reinterpret_cast<const unsigned char*>(packed.data()), packed.size()).empty(),
      "a tile that was written cannot be read");
}

}  // namespace
}  // namespace bki_mapping

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using bki_mapping::LooksLayout;
  for (const LooksLayout layout : {LooksLayout::kMasks, LooksLayout::kRows}) {
    bki_mapping::test(data, size, layout);
  }
  return 0;
}
