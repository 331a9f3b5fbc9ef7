#include "store/tile_codec.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <new>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "map/voxel_mask.h"
#include "store/schema.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kMaskBytes = kBlockVoxels / 8;
/// Deflate's limit: a compressed byte expands to at most this many bytes.
constexpr std::size_t kMostInflation = 1032;
constexpr std::size_t kLengthBytes = 4;
constexpr std::size_t kBeginBytes = 8, kLookBytes = kBeginBytes + 2 * kMaskBytes;  // in kLooks
// The flags of a block: the first bit says whether it has marks, the others are its number of looks.
constexpr std::size_t kMarked = 1, kMostLooks = 127;

void append32(std::string& bytes, std::uint32_t value) {
  for (unsigned shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(value >> shift & 0xffu);
}

std::uint32_t read32(const unsigned char* bytes) {
  return bytes[0] | std::uint32_t{bytes[1]} << 8 | std::uint32_t{bytes[2]} << 16 |
         std::uint32_t{bytes[3]} << 24;
}

unsigned char at(const std::string& bytes, std::size_t i) {
  return static_cast<unsigned char>(bytes[i]);
}

Bytef* bytesOf(std::string& text) {
  return reinterpret_cast<Bytef*>(text.data());
}
const Bytef* bytesOf(const std::string& text) {
  return reinterpret_cast<const Bytef*>(text.data());
}

void appendMask(std::string& bytes, const VoxelMask& mask) {
  const LayerBits bits = bitsOf(mask);
  bytes.append(reinterpret_cast<const char*>(bits.data()), sizeof bits);
}

VoxelMask readMask(const char* bytes) {
  LayerBits bits;
  std::memcpy(bits.data(), bytes, sizeof bits);
  return maskOf(bits);
}

/// Fills a plane with values at the voxels of a mask, and with 0 elsewhere. @return the next unused value.
const std::uint32_t* fillPlane(const char* mask, const std::uint32_t* values, EvidenceUnits* plane) {
  for (std::size_t byte = 0; byte < kMaskBytes; ++byte, plane += 8) {
    for (unsigned bits = static_cast<unsigned char>(mask[byte]), v = 0; v < 8; ++v, bits >>= 1) {
      plane[v] = (bits & 1u) != 0 ? static_cast<EvidenceUnits>(*values) : 0;
      values += bits & 1u;
    }
  }
  return values;
}

}  // namespace

LooksLayout looksLayoutOf(std::int64_t version) {
  if (version < kFirstVersionWithLooks) return LooksLayout::kNone;
  return version < kFirstVersionWithLookRows ? LooksLayout::kMasks : LooksLayout::kRows;
}

/// The streams of zlib, which take a quarter of a megabyte to set up.
struct TileCodec::Zlib {
  Zlib() {
    if (deflateInit2(&packing, kLevel, Z_DEFLATED, MAX_WBITS, MAX_MEM_LEVEL, Z_RLE) != Z_OK) {
      throw std::bad_alloc();
    }
    if (inflateInit(&unpacking) != Z_OK) {
      deflateEnd(&packing);
      throw std::bad_alloc();
    }
  }
  ~Zlib() {
    deflateEnd(&packing);
    inflateEnd(&unpacking);
  }
  Zlib(const Zlib&) = delete;
  Zlib& operator=(const Zlib&) = delete;

  /// Compresses a section. @return the bytes that it takes; 0 if there is no room for them.
  std::size_t pack(const std::string& bytes, Section section, Bytef* to, std::size_t room) {
    deflateReset(&packing);
    packing.avail_in = 0;  // older versions of zlib flush when parameters change
    packing.next_out = to;
    packing.avail_out = static_cast<uInt>(room);
    // Of evidence, only runs of equal bytes repeat; a search for longer matches costs time and gains nothing.
    // Of looks, whole masks do: beams reach a place alike in many intervals.
    const bool is_looks = section >= kLooks;
    deflateParams(&packing, is_looks ? kLevelOfLooks : kLevel, is_looks ? Z_DEFAULT_STRATEGY : Z_RLE);
    packing.next_in = const_cast<Bytef*>(bytesOf(bytes));
    packing.avail_in = static_cast<uInt>(bytes.size());
    return deflate(&packing, Z_FINISH) == Z_STREAM_END ? packing.total_out : 0;
  }

  static constexpr int kLevel = 1, kLevelOfLooks = 4;
  z_stream packing{}, unpacking{};
};

TileCodec::TileCodec(const ClassTable& classes, LooksLayout layout)
    : layout_(layout), zlib_(std::make_unique<Zlib>()) {
  for (const SemanticClass& c : classes.classes()) allowed_[c.id] = true;
  allowed_[kFreeClass] = true;
}

TileCodec::~TileCodec() = default;

void TileCodec::clear() {
  for (std::string* piece : {&numbers_, &plane_counts_, &flags_, &classes_, &levels_, &marks_,
                             &evidence_masks_, &begins_, &look_masks_}) {
    piece->clear();
  }
  look_rows_.clear();
  look_counts_.clear();
  looks_.clear();
  values_.clear();
  packed_.clear();
  blocks_ = 0;
}

bool TileCodec::takePlane(const EvidenceUnits* units) {
  const std::size_t before = values_.size(), masks_before = evidence_masks_.size();
  values_.resize(before + kBlockVoxels);
  evidence_masks_.resize(masks_before + kMaskBytes);
  std::uint32_t* next = values_.data() + before;
  for (std::size_t byte = 0; byte < kMaskBytes; ++byte) {
    unsigned mask = 0;
    for (unsigned bit = 0; bit < 8; ++bit) {
      const EvidenceUnits value = units[8 * byte + bit];
      *next = static_cast<std::uint32_t>(value);
      next += value != 0;
      mask |= static_cast<unsigned>(value != 0) << bit;
    }
    evidence_masks_[masks_before + byte] = static_cast<char>(mask);
  }
  const auto after = static_cast<std::size_t>(next - values_.data());
  values_.resize(after);
  if (after == before) evidence_masks_.resize(masks_before);
  return after != before;
}

void TileCodec::takeMasks(const Looks& looks) {
  for (const Look& look : looks.all()) {
    levels_ += static_cast<char>(look.level());
    for (unsigned shift = 0; shift < 8 * kBeginBytes; shift += 8) {
      begins_ += static_cast<char>(look.begin() >> shift & 0xffu);
    }
    appendMask(look_masks_, look.low());
    appendMask(look_masks_, look.high());
  }
}

void TileCodec::splitValues() {
  for (std::size_t byte = 0; byte < 4; ++byte) {
    std::string& section = sections_[kByte0 + byte];
    section.resize(values_.size());
    char* const out = section.data();
    for (std::size_t i = 0; i < values_.size(); ++i) out[i] = static_cast<char>(values_[i] >> 8 * byte);
  }
}

void TileCodec::joinValues() {
  values_.resize(sections_[kByte0].size());
  const Bytef* const bytes[] = {bytesOf(sections_[kByte0]), bytesOf(sections_[kByte1]),
                                bytesOf(sections_[kByte2]), bytesOf(sections_[kByte3])};
  for (std::size_t i = 0; i < values_.size(); ++i) {
    values_[i] = bytes[0][i] | std::uint32_t{bytes[1][i]} << 8 | std::uint32_t{bytes[2][i]} << 16 |
                 std::uint32_t{bytes[3][i]} << 24;
  }
}

std::uint32_t TileCodec::checksum(const TileKey& key, const TileEntry& entry) const {
  std::string head;
  for (const int number : {key.part, key.index.x, key.index.y, key.index.z, entry.blocks, entry.planes}) {
    append32(head, static_cast<std::uint32_t>(number));
  }
  uLong sum = crc32_z(0, bytesOf(head), head.size());
  for (const std::string& section : sections_) sum = crc32_z(sum, bytesOf(section), section.size());
  return static_cast<std::uint32_t>(sum);
}

std::size_t TileCodec::appendPacked(Section section) {
  const std::string& bytes = sections_[section];
  const std::size_t before = packed_.size();
  if (section != kList && !bytes.empty()) {
    const std::size_t room = bytes.size() - 1;  // for a stream that is shorter than the section itself
    packed_.resize(before + room);
    if (const std::size_t size = zlib_->pack(bytes, section, bytesOf(packed_) + before, room); size > 0) {
      packed_.resize(before + size);
      return size;
    }
    packed_.resize(before);
  }
  packed_ += bytes;
  return bytes.size();
}

TileEntry TileCodec::pack(const SemanticMap& map, const TileKey& key) {
  clear();
  const Region region(key.index);
  TileEntry entry{key.index};
  for (int number = 0; number < Region::kBlocks; ++number) {
    const Block* const block = map.find(region.blockIndex(number));
    if (!block) continue;
    int planes = 0;
    for (std::size_t p = 0; p < block->classes().size(); ++p) {
      const ClassId id = block->classes()[p];
      if (!allowed_[id]) {
        throw std::invalid_argument("the map has evidence for class " + std::to_string(id) +
                                    ", which is not in the class table");
      }
      if (!takePlane(block->plane(p))) continue;
      classes_ += static_cast<char>(id);
      ++planes;
    }
    const bool marked = block->occlusion().any();
    if (planes == 0 && !marked) continue;
    if (marked) appendMask(marks_, block->occlusion());
    const std::size_t looks = layout_ == LooksLayout::kNone ? 0 : block->looks().size();
    if (looks > 0 && layout_ == LooksLayout::kMasks) takeMasks(block->looks());
    if (looks > 0 && layout_ == LooksLayout::kRows) look_rows_.add(block->looks());
    numbers_ += static_cast<char>(number & 0xff);
    numbers_ += static_cast<char>(number >> 8);
    plane_counts_ += static_cast<char>(planes);
    flags_ += static_cast<char>((marked ? kMarked : 0) | looks << 1);
    ++entry.blocks;
    entry.planes += planes;
  }
  if (entry.blocks == 0) return entry;
  sections_[kList] = numbers_ + plane_counts_ + flags_ + classes_ + levels_;
  sections_[kMasks] = marks_ + evidence_masks_;
  LookSections rows = look_rows_.finish();
  sections_[kLooks] = begins_ + look_masks_ + rows.heads;
  sections_[kSeen] = std::move(rows.seen);
  sections_[kVoids] = std::move(rows.voids);
  sections_[kHits] = std::move(rows.hits);
  splitValues();
  entry.checksum = checksum(key, entry);
  packed_.assign(kLooks * kLengthBytes, '\0');
  const auto append = [&](Section section, std::size_t length_at) {
    const std::size_t length = appendPacked(section);
    for (unsigned i = 0; i < kLengthBytes; ++i) {
      packed_[length_at + i] = static_cast<char>(length >> 8 * i & 0xff);
    }
  };
  for (std::size_t section = 0; section < kLooks; ++section) {
    append(static_cast<Section>(section), section * kLengthBytes);
  }
  if (sections_[kLooks].empty()) return entry;
  for (std::size_t section = kLooks; section < endOfSections(); ++section) {
    const std::size_t length_at = packed_.size();
    packed_.append(kLengthBytes, '\0');
    append(static_cast<Section>(section), length_at);
  }
  return entry;
}

std::string TileCodec::checkList(const TileEntry& entry, std::size_t& marked) {
  const std::string& list = sections_[kList];
  const auto blocks = static_cast<std::size_t>(entry.blocks);
  const std::size_t end_of_classes = 4 * blocks + static_cast<std::size_t>(entry.planes);
  std::size_t next_class = 4 * blocks;
  int last_number = -1;
  marked = 0;
  std::size_t levels = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    const int number = at(list, 2 * b) | at(list, 2 * b + 1) << 8;
    if (number <= last_number || number >= Region::kBlocks) return "its blocks are out of order";
    last_number = number;
    const std::size_t planes = at(list, 2 * blocks + b), flags = at(list, 3 * blocks + b);
    if (planes + (flags & kMarked) == 0) return "a block is empty";
    if (flags > kMarked && layout_ == LooksLayout::kNone) return "a flag is not known";
    marked += flags & kMarked;
    if (flags > kMarked) look_counts_.push_back(flags >> 1);
    if (layout_ == LooksLayout::kMasks) levels += flags >> 1;
    if (planes > end_of_classes - next_class) return "planes are missing";
    for (std::size_t p = next_class; p < next_class + planes; ++p) {
      if (p > next_class && at(list, p) <= at(list, p - 1)) return "its planes are out of order";
      if (!allowed_[at(list, p)]) return "it has a class that is not in the class table";
    }
    next_class += planes;
  }
  if (next_class < end_of_classes) return "planes are left over";
  return end_of_classes + levels == list.size() ? "" : "it has another number of looks";
}

Looks TileCodec::masksAt(std::size_t& next, std::size_t count) const {
  const std::string &list = sections_[kList], &section = sections_[kLooks];
  const std::size_t all = section.size() / kLookBytes, first_level = list.size() - all;
  Looks looks;
  for (const std::size_t end = next + count; next < end; ++next) {
    std::uint64_t begin = 0;
    for (std::size_t i = 0; i < kBeginBytes; ++i) {
      begin |= std::uint64_t{at(section, next * kBeginBytes + i)} << 8 * i;
    }
    const char* const masks = section.data() + all * kBeginBytes + 2 * kMaskBytes * next;
    looks.append(Look(begin, at(list, first_level + next), readMask(masks), readMask(masks + kMaskBytes)));
  }
  return looks;
}

std::string TileCodec::readLooks() {
  LookRowsReader rows(look_counts_, sections_[kLooks], sections_[kSeen], sections_[kVoids], sections_[kHits]);
  std::size_t next = 0;
  for (const std::size_t count : look_counts_) {
    Looks looks;
    bool is_right = true;
    if (layout_ == LooksLayout::kRows) {
      is_right = rows.read(looks);
    } else {
      looks = masksAt(next, count);
    }
    if (!is_right || !looks.isCanonical()) return "its looks are wrong";
    looks.shrink();
    looks_.push_back(std::move(looks));
  }
  return "";
}

std::string TileCodec::unpack(const TileKey& key, const TileEntry& entry, const unsigned char* bytes,
                              std::size_t size) {
  clear();
  constexpr std::size_t kHead = kLooks * kLengthBytes;
  if (size < kHead) return "it is too short";
  const unsigned char* next = bytes + kHead;
  std::size_t left = size - kHead;
  const auto takeOf = [&](Section section, std::size_t length, std::size_t wanted) -> std::string {
    std::string& content = sections_[section];
    if (length > left || length > wanted || (section == kList && length != wanted)) {
      return "a length is wrong";
    }
    if (wanted > kMostInflation * (length + 1)) return "a length is wrong";
    content.resize(wanted);
    if (length == wanted) {
      std::copy(next, next + length, content.begin());
    } else {
      z_stream& stream = zlib_->unpacking;
      inflateReset(&stream);
      stream.next_in = const_cast<Bytef*>(next);
      stream.avail_in = static_cast<uInt>(length);
      stream.next_out = bytesOf(content);
      stream.avail_out = static_cast<uInt>(wanted);
      if (inflate(&stream, Z_FINISH) != Z_STREAM_END || stream.avail_in > 0 || stream.avail_out > 0) {
        return "it cannot be decompressed";
      }
    }
    next += length;
    left -= length;
    return "";
  };
  const auto take = [&](Section section, std::size_t wanted) {
    return takeOf(section, read32(bytes + section * kLengthBytes), wanted);
  };

  if (entry.blocks < 1 || entry.blocks > Region::kBlocks || entry.planes < 0) return "a count is wrong";
  const std::size_t blocks = static_cast<std::size_t>(entry.blocks),
                    least = 4 * blocks + static_cast<std::size_t>(entry.planes), listed = read32(bytes),
                    most_levels = layout_ == LooksLayout::kRows ? 0 : kMostLooks * blocks;
  if (listed < least || listed > least + most_levels) return "a length is wrong";
  std::string fault = take(kList, listed);
  std::size_t marked = 0;
  if (fault.empty()) fault = checkList(entry, marked);
  if (fault.empty()) fault = take(kMasks, kMaskBytes * (marked + static_cast<std::size_t>(entry.planes)));
  if (!fault.empty()) return fault;
  std::size_t values = 0;
  for (std::size_t begin = 0; begin < sections_[kMasks].size(); begin += kMaskBytes) {
    std::size_t bits = 0;
    for (std::size_t i = begin; i < begin + kMaskBytes; ++i) {
      bits += static_cast<std::size_t>(__builtin_popcount(at(sections_[kMasks], i)));
    }
    if (bits == 0) return "a plane is empty";
    if (begin >= kMaskBytes * marked) values += bits;
  }
  for (std::size_t section = kByte0; section < kLooks && fault.empty(); ++section) {
    fault = take(static_cast<Section>(section), values);
  }
  for (const Section section : {kLooks, kSeen, kVoids, kHits}) sections_[section].clear();
  const auto takeNext = [&](Section section, std::size_t wanted) -> std::string {
    if (left < kLengthBytes) return "it is too short";
    const std::size_t length = read32(next);
    next += kLengthBytes;
    left -= kLengthBytes;
    return takeOf(section, length, wanted);
  };
  if (fault.empty() && !look_counts_.empty() && layout_ == LooksLayout::kMasks) {
    fault = takeNext(kLooks,
                     kLookBytes * std::accumulate(look_counts_.begin(), look_counts_.end(), std::size_t{0}));
  } else if (fault.empty() && !look_counts_.empty()) {
    const LookRowsReader rows(look_counts_, sections_[kLooks], sections_[kSeen], sections_[kVoids],
                              sections_[kHits]);
    fault = takeNext(kLooks, LookRowsReader::bytesOfHeads(look_counts_));
    if (fault.empty()) fault = takeNext(kSeen, rows.bytesOfSeen());
    if (fault.empty()) fault = takeNext(kVoids, rows.bytesOfVoids());
    if (fault.empty()) fault = takeNext(kHits, rows.bytesOfHits());
  }
  if (!fault.empty()) return fault;
  if (left > 0) return "bytes are left over";
  if (checksum(key, entry) != entry.checksum) return "its checksum is wrong";
  joinValues();
  constexpr auto kLeast = static_cast<std::uint32_t>(std::numeric_limits<EvidenceUnits>::min());
  for (const std::uint32_t value : values_) {
    if (value == 0 || value == kLeast) return "a value is out of range";
  }
  blocks_ = entry.blocks;
  return readLooks();
}

void TileCodec::addTo(SemanticMap& map, const TileKey& key) const {
  const Region region(key.index);
  const std::string &list = sections_[kList], &masks = sections_[kMasks];
  const auto blocks = static_cast<std::size_t>(blocks_);
  std::size_t marked = 0;
  for (std::size_t b = 0; b < blocks; ++b) marked += at(list, 3 * blocks + b) & kMarked;
  const char *marks = masks.data(), *mask = marks + kMaskBytes * marked;
  const std::uint32_t* value = values_.data();
  std::array<EvidenceUnits, kBlockVoxels> plane;
  std::size_t next_class = 4 * blocks, next_looks = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    const BlockIndex index = region.blockIndex(at(list, 2 * b) | at(list, 2 * b + 1) << 8);
    const bool is_new = !map.find(index);
    Block& block = map.getOrAllocate(index);
    const std::size_t planes = at(list, 2 * blocks + b);
    if (is_new) block.reserve(planes);
    for (std::size_t p = 0; p < planes; ++p, ++next_class, mask += kMaskBytes) {
      if (is_new) {
        block.change(at(list, next_class), [&](EvidenceUnits* units) {
          value = fillPlane(mask, value, units);
          return true;
        });
      } else {
        value = fillPlane(mask, value, plane.data());
        block.add(at(list, next_class), plane.data());
      }
    }
    const std::size_t flags = at(list, 3 * blocks + b);
    if (flags > kMarked) {
      const Looks& looks = looks_[next_looks++];
      block.looks().reserve(looks);
      block.looks().add(looks);
    }
    if ((flags & kMarked) != 0) {
      block.setOcclusion(block.occlusion() | readMask(marks));
      marks += kMaskBytes;
    }
    if (block.empty()) map.erase(index);  // negative evidence may have cancelled all of it
  }
}

}  // namespace bki_mapping
