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

/// @param compressed a bit for the masks, one for each byte of values, and one for the looks. @param[out]
/// checksum of the content, as entry.checksum should be.
std::string framed(Bytes& bytes, const TileKey& key, TileEntry& entry, std::size_t compressed,
                   TileLayout layout) {
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
  if (layout == TileLayout::kLookMasks) sections[0] += bytes.string(looks);
  sections[1] = bytes.string(64 * (marked + planes));
  EvidenceSections::Planes all_planes;
  std::size_t values = 0;
  for (std::size_t p = 0; p < planes; ++p) {
    const bool is_free = static_cast<unsigned char>(sections[0][4 * blocks + p]) == kFreeClass;
    all_planes.push_back({is_free ? EvidenceSections::kFree : EvidenceSections::kOther, 0});
    for (std::size_t b = 64 * (marked + p); b < 64 * (marked + p + 1); ++b) {
      all_planes.back().values +=
          static_cast<std::size_t>(__builtin_popcount(static_cast<unsigned char>(sections[1][b])));
    }
    values += all_planes.back().values;
  }
  EvidenceSections::StepsOfKinds steps;
  std::vector<std::string> of_steps(EvidenceSections::kSections);
  if (layout == TileLayout::kSteps) {
    for (EvidenceSteps& each : steps) {
      each.a = static_cast<std::uint32_t>(bytes.number(4));
      each.b = static_cast<std::uint32_t>(bytes.number(4));
    }
    const std::size_t present = bytes.number(3);
    EvidenceSections::Values sum(values);
    for (std::size_t n = 0; n < of_steps.size(); ++n) {
      if ((present >> n & 1) == 0) continue;
      of_steps[n] = bytes.string(EvidenceSections::count(all_planes, EvidenceSections::kindOf(n)));
      EvidenceSections::add(n, of_steps[n], all_planes, steps, sum);
    }
    for (std::size_t byte = 0; byte < 4; ++byte) {
      for (const std::uint32_t value : sum) sections[2 + byte] += static_cast<char>(value >> 8 * byte);
    }
  } else {
    for (std::size_t s = 2; s < 6; ++s) sections[s] = bytes.string(values);
  }
  if (layout == TileLayout::kLookMasks) {
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
  const auto append32 = [](std::size_t number, std::string& to) {
    for (unsigned shift = 0; shift < 32; shift += 8) to += static_cast<char>(number >> shift);
  };
  constexpr std::size_t kNever = 8;  // no bit of `compressed`, which is a byte
  const auto append = [&](std::string section, std::size_t bit, std::string& length) {
    if ((compressed >> bit & 1) != 0) {
      std::string packed = deflated(section);
      if (packed.size() < section.size()) section = std::move(packed);
    }
    append32(section.size(), length);
    body += section;
  };
  for (std::size_t s = 0; s < sections.size(); ++s) {
    if ((s == 6 && looks == 0) || (s == 7 && layout == TileLayout::kLookMasks)) break;
    checksum = crc32_z(checksum, reinterpret_cast<const Bytef*>(sections[s].data()), sections[s].size());
    const bool is_value = s >= 2 && s < 6;
    if (layout == TileLayout::kSteps && is_value) {
      if (s > 2) continue;
      std::size_t present = 0;
      for (const EvidenceSteps& each : steps) {
        append32(each.a, head);
        append32(each.b, head);
      }
      for (std::size_t n = 0; n < of_steps.size(); ++n) {
        present |= static_cast<std::size_t>(!of_steps[n].empty()) << n;
      }
      append32(present, head);
      for (std::size_t n = 0; n < of_steps.size(); ++n) {
        if (!of_steps[n].empty()) append(of_steps[n], 2 + n % 4, head);
      }
      continue;
    }
    append(sections[s], s == 0 ? kNever : std::min<std::size_t>(s, 6), s < 6 ? head : body);
  }
  entry.checksum = static_cast<std::uint32_t>(checksum);
  return head + body;
}

void test(const unsigned char* data, std::size_t size, TileLayout layout) {
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
  using bki_mapping::TileLayout;
  for (const TileLayout layout : {TileLayout::kLookMasks, TileLayout::kLookRows, TileLayout::kSteps}) {
    bki_mapping::test(data, size, layout);
  }
  return 0;
}
