#include "store/tile_codec.h"

#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <map>
#include <new>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/settings/yaml.h"
#include "map/voxel_mask.h"
#include "store/schema.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kMaskBytes = kBlockVoxels / 8;
/// Deflate's limit: a compressed byte expands to at most this many bytes.
constexpr std::size_t kMostInflation = 1032;
constexpr std::size_t kLengthBytes = 4;
/// With kSteps: the numbers before the lengths of the sections of values; and the first of them that is a
/// step, after the lengths of the list and the masks.
constexpr std::size_t kHeadNumbers = 7, kFirstStep = 2;
constexpr std::size_t kBeginBytes = 8, kLookBytes = kBeginBytes + 2 * kMaskBytes;  // in kLooks
// The flags of a block: the first bit says whether it has marks, the others are its number of looks.
constexpr std::size_t kMarked = 1, kMostLooks = 127;

void write32(std::uint32_t value, std::size_t at, std::string& bytes) {
  for (std::size_t i = 0; i < kLengthBytes; ++i) bytes[at + i] = static_cast<char>(value >> 8 * i & 0xffu);
}

void append32(std::uint32_t value, std::string& bytes) {
  bytes.resize(bytes.size() + kLengthBytes);
  write32(value, bytes.size() - kLengthBytes, bytes);
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

EvidenceSections::Kind kindOf(ClassId id) {
  return id == kFreeClass ? EvidenceSections::kFree : EvidenceSections::kOther;
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

TileLayout tileLayoutOf(std::int64_t version) {
  if (version < kFirstVersionWithLooks) return TileLayout::kNoLooks;
  if (version < kFirstVersionWithLookRows) return TileLayout::kLookMasks;
  return version < kFirstVersionWithSteps ? TileLayout::kLookRows : TileLayout::kSteps;
}

RulesConfig rulesOfParameters(const std::string& parameters) {
  constexpr char kName[] = "rules/void_outweighs";
  MapperConfig config;
  try {
    const std::map<std::string, std::string> all = parseParameters(parameters);
    if (const auto found = all.find(kName); found != all.end()) setParameters(config, {*found});
  } catch (const std::invalid_argument&) {
  }
  return config.rules;
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

TileCodec::TileCodec(const ClassTable& classes, TileLayout layout)
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
  planes_.clear();
  packed_.clear();
  blocks_ = 0;
}

bool TileCodec::takePlane(ClassId id, const EvidenceUnits* units) {
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
  if (after == before) {
    evidence_masks_.resize(masks_before);
    return false;
  }
  classes_ += static_cast<char>(id);
  planes_.push_back({kindOf(id), after - before});
  return true;
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

template <typename Add>
void TileCodec::forEachPiece(std::size_t byte, Add&& add) const {
  constexpr std::size_t kPiece = 4096;
  std::string piece;
  for (std::size_t begin = 0; begin < values_.size(); begin += kPiece) {
    piece.resize(std::min(kPiece, values_.size() - begin));
    for (std::size_t i = 0; i < piece.size(); ++i) {
      piece[i] = static_cast<char>(values_[begin + i] >> 8 * byte);
    }
    add(piece);
  }
}

void TileCodec::splitValues() {
  if (layout_ == TileLayout::kSteps) {
    steps_ = EvidenceSections::fittingOf(EvidenceSections::stepsOf(rules_), planes_, values_);
    EvidenceSections::split(planes_, values_, steps_, &sections_[kValues]);
    return;
  }
  for (std::size_t byte = 0; byte < kBytes; ++byte) {
    std::string& section = sections_[kValues + byte];
    section.clear();
    forEachPiece(byte, [&](const std::string& piece) { section += piece; });
  }
}

void TileCodec::joinValues() {
  std::size_t count = 0;
  for (const auto& plane : planes_) count += plane.values;
  values_.assign(count, 0);
  for (std::size_t section = kValues; section < endOfValues(); ++section) {
    const std::string& bytes = sections_[section];
    if (bytes.empty()) continue;
    if (layout_ == TileLayout::kSteps) {
      EvidenceSections::add(section - kValues, bytes, planes_, steps_, values_);
      continue;
    }
    for (std::size_t i = 0; i < count; ++i) {
      values_[i] |= std::uint32_t{at(bytes, i)} << 8 * (section - kValues);
    }
  }
}

std::uint32_t TileCodec::checksum(const TileKey& key, const TileEntry& entry) const {
  std::string head;
  for (const int number : {key.part, key.index.x, key.index.y, key.index.z, entry.blocks, entry.planes}) {
    append32(static_cast<std::uint32_t>(number), head);
  }
  uLong sum = 0;
  const auto add = [&](const std::string& bytes) { sum = crc32_z(sum, bytesOf(bytes), bytes.size()); };
  add(head);
  for (const Section section : {kList, kMasks}) add(sections_[section]);
  for (std::size_t byte = 0; byte < kBytes; ++byte) forEachPiece(byte, add);
  for (const Section section : {kLooks, kSeen, kVoids, kHits}) add(sections_[section]);
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

std::size_t TileCodec::lengthAt(std::size_t n) const {
  const bool is_after_head = layout_ == TileLayout::kSteps && n >= kFirstStep;
  return kLengthBytes * (is_after_head ? kHeadNumbers + n - kFirstStep : n);
}

std::vector<TileCodec::Section> TileCodec::beginPacked() {
  std::vector<Section> sections = {kList, kMasks};
  std::uint32_t present = 0;
  for (std::size_t section = kValues; section < endOfValues(); ++section) {
    if (layout_ == TileLayout::kSteps && sections_[section].empty()) continue;
    sections.push_back(static_cast<Section>(section));
    present |= std::uint32_t{1} << (section - kValues);
  }
  packed_.assign(lengthAt(sections.size()), '\0');
  if (layout_ == TileLayout::kSteps) {
    std::size_t next = kFirstStep * kLengthBytes;
    for (const EvidenceSteps& steps : steps_) {
      for (const std::uint32_t step : {steps.a, steps.b}) {
        write32(step, next, packed_);
        next += kLengthBytes;
      }
    }
    write32(present, next, packed_);
  }
  return sections;
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
      planes += takePlane(id, block->plane(p));
    }
    const bool marked = block->occlusion().any();
    if (planes == 0 && !marked) continue;
    if (marked) appendMask(marks_, block->occlusion());
    const std::size_t looks = layout_ == TileLayout::kNoLooks ? 0 : block->looks().size();
    if (looks > 0 && layout_ == TileLayout::kLookMasks) takeMasks(block->looks());
    if (looks > 0 && hasLookRows()) look_rows_.add(block->looks());
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
  const auto append = [&](Section section, std::size_t length_at) {
    write32(static_cast<std::uint32_t>(appendPacked(section)), length_at, packed_);
  };
  const std::vector<Section> sections = beginPacked();
  for (std::size_t n = 0; n < sections.size(); ++n) append(sections[n], lengthAt(n));
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
    if (flags > kMarked && layout_ == TileLayout::kNoLooks) return "a flag is not known";
    marked += flags & kMarked;
    if (flags > kMarked) look_counts_.push_back(flags >> 1);
    if (layout_ == TileLayout::kLookMasks) levels += flags >> 1;
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
    if (hasLookRows()) {
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

/// The bytes of a packed tile while they are read.
struct TileCodec::Input {
  Input(const unsigned char* all, std::size_t size) : bytes(all), next(all), left(size) {}

  const unsigned char* bytes;
  const unsigned char* next;     ///< the first that has not been read
  std::size_t left;              ///< number of bytes from there on
  std::size_t lengths_read = 0;  ///< number of the lengths before all sections that have been read
  std::uint32_t present = 0;     ///< a bit for each section of values that is there

  void skip(std::size_t count) {
    next += count;
    left -= count;
  }
};

std::string TileCodec::readHead(Input& input) {
  const bool has_steps = layout_ == TileLayout::kSteps;
  if (input.left < (has_steps ? kHeadNumbers * kLengthBytes : lengthAt(kValues + kBytes))) {
    return "it is too short";
  }
  input.present = (1u << kBytes) - 1;
  if (has_steps) {
    const unsigned char* number = input.bytes + kFirstStep * kLengthBytes;
    for (EvidenceSteps& steps : steps_) {
      steps = {read32(number), read32(number + kLengthBytes)};
      number += 2 * kLengthBytes;
    }
    input.present = read32(number);
    if (input.present >> EvidenceSections::kSections != 0) return "a section is not known";
  }
  const std::size_t head = lengthAt(kValues + static_cast<std::size_t>(__builtin_popcount(input.present)));
  if (input.left < head) return "it is too short";
  input.skip(head);
  return "";
}

std::string TileCodec::take(Section section, std::size_t length, std::size_t wanted, Input& input) {
  std::string& content = sections_[section];
  if (length > input.left || length > wanted || (section == kList && length != wanted)) {
    return "a length is wrong";
  }
  if (wanted > kMostInflation * (length + 1)) return "a length is wrong";
  content.resize(wanted);
  if (length == wanted) {
    std::copy(input.next, input.next + length, content.begin());
  } else {
    z_stream& stream = zlib_->unpacking;
    inflateReset(&stream);
    stream.next_in = const_cast<Bytef*>(input.next);
    stream.avail_in = static_cast<uInt>(length);
    stream.next_out = bytesOf(content);
    stream.avail_out = static_cast<uInt>(wanted);
    if (inflate(&stream, Z_FINISH) != Z_STREAM_END || stream.avail_in > 0 || stream.avail_out > 0) {
      return "it cannot be decompressed";
    }
  }
  input.skip(length);
  return "";
}

std::string TileCodec::takeListed(Section section, std::size_t wanted, Input& input) {
  return take(section, read32(input.bytes + lengthAt(input.lengths_read++)), wanted, input);
}

std::string TileCodec::takeNext(Section section, std::size_t wanted, Input& input) {
  if (input.left < kLengthBytes) return "it is too short";
  const std::size_t length = read32(input.next);
  input.skip(kLengthBytes);
  return take(section, length, wanted, input);
}

std::string TileCodec::unpackPlanes(const TileEntry& entry, Input& input) {
  if (entry.blocks < 1 || entry.blocks > Region::kBlocks || entry.planes < 0) return "a count is wrong";
  const auto blocks = static_cast<std::size_t>(entry.blocks), planes = static_cast<std::size_t>(entry.planes);
  const std::size_t first_class = 4 * blocks, least = first_class + planes, listed = read32(input.bytes),
                    most_levels = hasLookRows() ? 0 : kMostLooks * blocks;
  if (listed < least || listed > least + most_levels) return "a length is wrong";
  std::size_t marked = 0;
  std::string fault = takeListed(kList, listed, input);
  if (fault.empty()) fault = checkList(entry, marked);
  if (fault.empty()) fault = takeListed(kMasks, kMaskBytes * (marked + planes), input);
  if (!fault.empty()) return fault;
  planes_.reserve(planes);
  for (std::size_t mask = 0; mask < marked + planes; ++mask) {
    std::size_t bits = 0;
    for (std::size_t i = kMaskBytes * mask; i < kMaskBytes * (mask + 1); ++i) {
      bits += static_cast<std::size_t>(__builtin_popcount(at(sections_[kMasks], i)));
    }
    if (bits == 0) return "a plane is empty";
    if (mask >= marked) planes_.push_back({kindOf(at(sections_[kList], first_class + mask - marked)), bits});
  }
  return "";
}

std::string TileCodec::unpackValues(Input& input) {
  std::array<std::size_t, EvidenceSections::kKinds> of_kinds = {};
  for (const EvidenceSections::Kind kind : {EvidenceSections::kFree, EvidenceSections::kOther}) {
    of_kinds[kind] = EvidenceSections::count(planes_, kind);
    const std::uint32_t of_kind = input.present >> kind * EvidenceSections::kOfKind;
    const bool all_are_0 = of_kind % (1u << EvidenceSections::kOfKind) == 0;
    if (layout_ == TileLayout::kSteps && of_kinds[kind] > 0 && all_are_0) return "a value is out of range";
  }
  const std::size_t all = of_kinds[EvidenceSections::kFree] + of_kinds[EvidenceSections::kOther];
  for (std::size_t n = 0; n < EvidenceSections::kSections; ++n) {
    sections_[kValues + n].clear();
    if ((input.present >> n & 1) == 0) continue;
    const std::size_t wanted = layout_ == TileLayout::kSteps ? of_kinds[EvidenceSections::kindOf(n)] : all;
    std::string fault = takeListed(static_cast<Section>(kValues + n), wanted, input);
    if (!fault.empty()) return fault;
  }
  return "";
}

std::string TileCodec::unpackLooks(Input& input) {
  for (const Section section : {kLooks, kSeen, kVoids, kHits}) sections_[section].clear();
  if (look_counts_.empty()) return "";
  if (!hasLookRows()) {
    const std::size_t looks = std::accumulate(look_counts_.begin(), look_counts_.end(), std::size_t{0});
    return takeNext(kLooks, kLookBytes * looks, input);
  }
  const LookRowsReader rows(look_counts_, sections_[kLooks], sections_[kSeen], sections_[kVoids],
                            sections_[kHits]);
  std::string fault = takeNext(kLooks, LookRowsReader::bytesOfHeads(look_counts_), input);
  if (fault.empty()) fault = takeNext(kSeen, rows.bytesOfSeen(), input);
  if (fault.empty()) fault = takeNext(kVoids, rows.bytesOfVoids(), input);
  if (fault.empty()) fault = takeNext(kHits, rows.bytesOfHits(), input);
  return fault;
}

std::string TileCodec::unpack(const TileKey& key, const TileEntry& entry, const unsigned char* bytes,
                              std::size_t size) {
  clear();
  Input input(bytes, size);
  std::string fault = readHead(input);
  if (fault.empty()) fault = unpackPlanes(entry, input);
  if (fault.empty()) fault = unpackValues(input);
  if (fault.empty()) fault = unpackLooks(input);
  if (!fault.empty()) return fault;
  if (input.left > 0) return "bytes are left over";
  joinValues();
  if (checksum(key, entry) != entry.checksum) return "its checksum is wrong";
  constexpr auto kLeast = static_cast<std::uint32_t>(std::numeric_limits<EvidenceUnits>::min());
  for (const std::uint32_t value : values_) {
    if (value == 0 || value == kLeast) return "a value is out of range";
  }
  fault = readLooks();
  if (fault.empty()) blocks_ = entry.blocks;
  return fault;
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
