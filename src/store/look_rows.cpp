#include "store/look_rows.h"

#include <numeric>
#include <utility>

namespace bki_mapping {
namespace {

constexpr std::size_t kHeadBytes = 3 * 8;

/// A bit for each row, row n along y and then z, that has a voxel of a mask.
std::uint64_t rowsOf(const LayerBits& bits) {
  std::uint64_t rows = 0;
  for (std::size_t z = 0; z < bits.size(); ++z) {
    std::uint64_t layer = bits[z];
    for (const unsigned shift : {4u, 2u, 1u}) layer |= layer >> shift;  // the lowest bit of a byte: any of it
    rows |= (layer & 0x0101010101010101) * 0x0102040810204080 >>
            56 << kBlockEdge * z;  // these bits, side by side
  }
  return rows;
}

std::size_t countOf(std::uint64_t rows) {
  return static_cast<std::size_t>(__builtin_popcountll(rows));
}

void append64(std::string& bytes, std::uint64_t value) {
  for (unsigned shift = 0; shift < 64; shift += 8) bytes += static_cast<char>(value >> shift & 0xff);
}

std::uint64_t read64(const std::string& bytes, std::size_t position) {
  std::uint64_t value = 0;
  for (unsigned n = 0; n < 8; ++n) {
    value |= std::uint64_t{static_cast<unsigned char>(bytes[position + n])} << 8 * n;
  }
  return value;
}

void appendRows(std::string& bytes, const LayerBits& bits, std::uint64_t rows) {
  for (; rows != 0; rows &= rows - 1) {
    const auto row = static_cast<unsigned>(__builtin_ctzll(rows));
    bytes += static_cast<char>(bits[row / kBlockEdge] >> row % kBlockEdge * 8 & 0xff);
  }
}

LayerBits readRows(const std::string& bytes, std::size_t& position, std::uint64_t rows) {
  LayerBits bits{};
  for (; rows != 0; rows &= rows - 1) {
    const auto row = static_cast<unsigned>(__builtin_ctzll(rows));
    bits[row / kBlockEdge] |= std::uint64_t{static_cast<unsigned char>(bytes[position++])}
                              << row % kBlockEdge * 8;
  }
  return bits;
}

}  // namespace

void LookRowsWriter::clear() {
  for (std::string* piece :
       {&sections_.heads, &sections_.seen, &sections_.voids, &sections_.hits, &levels_}) {
    piece->clear();
  }
}

void LookRowsWriter::add(const Looks& looks) {
  const std::vector<Look> all = looks.all();
  Look::Voxels ever_seen, ever_hit;
  for (const Look& look : all) {
    ever_seen |= look.seen();
    ever_hit |= look.hit();
  }
  const std::uint64_t latest = all.back().begin(), seen_rows = rowsOf(bitsOf(ever_seen)),
                      hit_rows = rowsOf(bitsOf(ever_hit));
  for (const std::uint64_t part : {latest, seen_rows, hit_rows}) append64(sections_.heads, part);
  for (const Look& look : all) {
    const std::uint64_t age = (latest >> look.level()) - (look.begin() >> look.level());  // 0 or 1 intervals
    levels_ += static_cast<char>(2 * look.level() + age);
    const LayerBits seen = bitsOf(look.seen());
    appendRows(sections_.seen, seen, seen_rows);
    const std::uint64_t rows = rowsOf(seen);
    appendRows(sections_.voids, bitsOf(look.voids()), rows);
    appendRows(sections_.hits, bitsOf(look.hit()), rows & hit_rows);
  }
}

LookSections LookRowsWriter::finish() {
  sections_.heads += levels_;
  levels_.clear();
  return std::exchange(sections_, {});
}

std::size_t LookRowsReader::bytesOfHeads(const std::vector<std::size_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), kHeadBytes * counts.size());
}

LookRowsReader::Head LookRowsReader::headOf(std::size_t block) const {
  const std::size_t begin = kHeadBytes * block;
  return {read64(sections_.heads, begin), read64(sections_.heads, begin + 8),
          read64(sections_.heads, begin + 16)};
}

std::size_t LookRowsReader::bytesOfSeen() const {
  std::size_t bytes = 0;
  for (std::size_t b = 0; b < counts_.size(); ++b) bytes += counts_[b] * countOf(headOf(b).seen_rows);
  return bytes;
}

std::size_t LookRowsReader::bytesBySeen(bool of_hits) const {
  std::size_t bytes = 0, position = 0;
  for (std::size_t b = 0; b < counts_.size(); ++b) {
    const Head head = headOf(b);
    const std::uint64_t counted = of_hits ? head.hit_rows : head.seen_rows;
    for (std::size_t n = 0; n < counts_[b]; ++n) {
      bytes += countOf(rowsOf(readRows(sections_.seen, position, head.seen_rows)) & counted);
    }
  }
  return bytes;
}

bool LookRowsReader::read(Looks& looks) {
  const Head head = headOf(block_);
  const std::size_t first_level = kHeadBytes * counts_.size();
  bool is_right = head.latest <= Look::tickOf(~std::uint64_t{0});
  Look::Voxels ever_seen, ever_hit;
  for (const std::size_t end = look_ + counts_[block_]; look_ < end; ++look_) {
    const auto coded = static_cast<unsigned char>(sections_.heads[first_level + look_]);
    const unsigned level = coded / 2;
    is_right &= level < 64;  // as all are in which a byte has room
    const std::uint64_t begin = ((head.latest >> level % 64) - coded % 2) << level % 64;
    const LayerBits seen = readRows(sections_.seen, seen_, head.seen_rows);
    const std::uint64_t rows = rowsOf(seen);
    const Look::Voxels all = maskOf(seen), voids = maskOf(readRows(sections_.voids, voids_, rows)),
                       hits = maskOf(readRows(sections_.hits, hits_, rows & head.hit_rows));
    is_right &= ((voids | hits) & ~all).none() && (voids & hits).none();
    ever_seen |= all;
    ever_hit |= hits;
    looks.append(Look(begin, level, (all & ~voids) | hits, voids | hits));
  }
  ++block_;
  return is_right && rowsOf(bitsOf(ever_seen)) == head.seen_rows &&
         rowsOf(bitsOf(ever_hit)) == head.hit_rows && looks.begin()->begin() == head.latest &&
         looks.isCanonical();
}

}  // namespace bki_mapping
