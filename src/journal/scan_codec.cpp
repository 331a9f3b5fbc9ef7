// The format of a packed scan, in little-endian numbers: the fields of Header, then, as one zlib stream,
// planes of bytes: of the coordinates of hits, their labels, the coordinates of directions, the numbers of
// classes, the classes and their shares. The planes of numbers of several bytes begin with that of the lowest
// bytes. Coordinates are differences to the point before, as unsigned numbers (zigzag), first of all x, then
// of all y, then of all z.
#include "journal/scan_codec.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace bki_mapping {
namespace {

constexpr std::uint32_t kMagic = 0x31534b42;  // "BKS1"
/// Deflate's limit: a packed byte expands to at most this many.
constexpr std::uint64_t kMostExpansion = 1032;
/// Hits, directions or shares of a scan, so that a small file cannot take all memory.
constexpr std::size_t kMostPoints = std::size_t{1} << 26;

enum Flags : std::uint32_t { kIds = 1, kSoft = 2, kSensor = 4 };

struct Header {
  std::uint32_t magic, flags;
  std::uint64_t stamp;
  double quantum, min_range, max_range, height;
  std::uint32_t points, shares, no_returns, packed_size;
};
static_assert(sizeof(Header) == 64);

/// Bytes of what follows the header, unpacked.
std::uint64_t bodySize(const Header& header) {
  const std::uint64_t soft = header.flags & kSoft ? header.points + 3ull * header.shares : 0;
  return 16ull * header.points + soft + 12ull * header.no_returns;
}

std::uint32_t zigzag(std::int32_t n) {
  return (static_cast<std::uint32_t>(n) << 1) ^ static_cast<std::uint32_t>(n >> 31);
}
std::int32_t unzigzag(std::uint32_t n) {
  return static_cast<std::int32_t>((n >> 1) ^ (~(n & 1) + 1));
}

/// Writes values of several bytes as planes of bytes.
class PlaneWriter {
 public:
  explicit PlaneWriter(std::size_t size) { bytes_.reserve(size); }

  /// @param valueAt called as valueAt(n), returns an unsigned number; in rising order of n, once for each
  /// byte.
  template <typename ValueAt>
  void write(std::size_t count, int bytes, ValueAt&& valueAt) {
    for (int byte = 0; byte < bytes; ++byte) {
      const std::size_t begin = bytes_.size();
      bytes_.resize(begin + count);
      char* const plane = bytes_.data() + begin;
      for (std::size_t n = 0; n < count; ++n) plane[n] = static_cast<char>(valueAt(n) >> (8 * byte) & 0xff);
      ends_.push_back(bytes_.size());
    }
  }
  void writeDifferences(const std::vector<SensorScan::Coordinates>& points) {
    differences_.resize(points.size());
    for (std::size_t axis = 0; axis < 3; ++axis) {
      std::uint32_t before = 0;
      for (std::size_t n = 0; n < points.size(); ++n) {
        const auto now = static_cast<std::uint32_t>(points[n][axis]);
        differences_[n] = zigzag(static_cast<std::int32_t>(now - before));
        before = now;
      }
      write(points.size(), 4, [values = differences_.data()](std::size_t n) { return values[n]; });
    }
  }
  /// The planes, one after another, as one zlib stream.
  std::string packed() const;

 private:
  std::string bytes_;
  std::vector<std::size_t> ends_;  ///< of the planes
  std::vector<std::uint32_t> differences_;
};

/// Reads what PlaneWriter writes.
class PlaneReader {
 public:
  explicit PlaneReader(const std::string& bytes) : next_(bytes.data()) {}

  template <typename Value>
  void read(std::vector<Value>& values, std::size_t count, int bytes = sizeof(Value)) {
    values.assign(count, 0);
    for (int byte = 0; byte < bytes; ++byte) {
      for (Value& value : values) {
        value =
            static_cast<Value>(value | static_cast<Value>(static_cast<std::uint8_t>(*next_++)) << (8 * byte));
      }
    }
  }
  void readDifferences(std::vector<SensorScan::Coordinates>& points, std::size_t count) {
    points.resize(count);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      read(differences_, count);
      std::uint32_t sum = 0;
      for (std::size_t n = 0; n < count; ++n) {
        sum += static_cast<std::uint32_t>(unzigzag(differences_[n]));
        points[n][axis] = static_cast<std::int32_t>(sum);
      }
    }
  }

 private:
  const char* next_;
  std::vector<std::uint32_t> differences_;
};

std::string PlaneWriter::packed() const {
  constexpr int kMemoryLevel = 8;  // smaller tables than zlib's largest: they stay in the cache
  constexpr std::size_t kBlockEnd = 16;
  z_stream stream = {};
  // Runs only: on these planes it packs better than zlib's fast levels, and takes less time.
  if (deflateInit2(&stream, 1, Z_DEFLATED, MAX_WBITS, kMemoryLevel, Z_RLE) != Z_OK) throw std::bad_alloc();
  std::string packed(deflateBound(&stream, bytes_.size()) + kBlockEnd * (ends_.size() + 1), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes_.data()));
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  std::size_t begin = 0;
  for (const std::size_t end : ends_) {  // a block for each plane, since each has its own frequencies
    stream.avail_in = static_cast<uInt>(end - begin);
    deflate(&stream, Z_BLOCK);
    begin = end;
  }
  deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::string inflated(std::string_view packed, std::size_t size) {
  std::string bytes(size, '\0');
  uLongf length = size;
  const int code = uncompress(reinterpret_cast<Bytef*>(bytes.data()), &length,
                              reinterpret_cast<const Bytef*>(packed.data()), packed.size());
  if (code == Z_MEM_ERROR) throw std::bad_alloc();
  if (code != Z_OK || length != size) throw ScanDamaged("its points cannot be unpacked");
  return bytes;
}

Header headerOf(std::string_view bytes) {
  Header header;
  if (bytes.size() < sizeof(header)) throw ScanDamaged("it is too short");
  std::memcpy(&header, bytes.data(), sizeof(header));
  if (header.magic != kMagic) throw ScanDamaged("it does not begin as a scan");
  if (bytes.size() - sizeof(header) != header.packed_size) throw ScanDamaged("its size is not as it says");
  if (bodySize(header) > kMostExpansion * header.packed_size || header.points > kMostPoints ||
      header.no_returns > kMostPoints || header.shares > kMostPoints) {
    throw ScanDamaged("it claims too many points");
  }
  const bool real = std::isfinite(header.quantum) && header.quantum > 0.0 &&
                    std::isfinite(header.min_range) && std::isfinite(header.max_range) &&
                    std::isfinite(header.height);
  if (!real) throw ScanDamaged("its numbers are not finite");
  return header;
}

}  // namespace

std::string packScan(const SensorScan& scan) {
  if (scan.points.size() > kMostPoints || scan.no_returns.size() > kMostPoints ||
      scan.soft_ids.size() > kMostPoints) {
    throw std::length_error("a scan has more points than a journal can hold");
  }
  const bool soft = !scan.soft_counts.empty();
  Header header = {};
  header.magic = kMagic;
  header.flags = (scan.labels_are_ids ? kIds : 0u) | (soft ? kSoft : 0u) | (scan.sensor_model ? kSensor : 0u);
  header.stamp = scan.stamp;
  header.quantum = scan.quantum;
  if (scan.sensor_model) {
    header.min_range = scan.sensor_model->min_range;
    header.max_range = scan.sensor_model->max_range;
    header.height = scan.sensor_model->height;
  }
  header.points = static_cast<std::uint32_t>(scan.points.size());
  header.shares = static_cast<std::uint32_t>(scan.soft_ids.size());
  header.no_returns = static_cast<std::uint32_t>(scan.no_returns.size());
  PlaneWriter body(bodySize(header));
  body.writeDifferences(scan.points);
  body.write(scan.labels.size(), 4, [values = scan.labels.data()](std::size_t n) { return values[n]; });
  body.writeDifferences(scan.no_returns);
  if (soft) {
    body.write(scan.soft_counts.size(), 1, [&](std::size_t n) { return scan.soft_counts[n]; });
    body.write(scan.soft_ids.size(), 1, [&](std::size_t n) { return scan.soft_ids[n]; });
    body.write(scan.soft_shares.size(), 2, [&](std::size_t n) { return scan.soft_shares[n]; });
  }
  const std::string packed = body.packed();
  header.packed_size = static_cast<std::uint32_t>(packed.size());
  std::string bytes(reinterpret_cast<const char*>(&header), sizeof(header));
  return bytes += packed;
}

SensorScan unpackScan(std::string_view bytes) {
  const Header header = headerOf(bytes);
  const std::string body = inflated(bytes.substr(sizeof(header)), bodySize(header));
  SensorScan scan;
  scan.quantum = header.quantum;
  scan.labels_are_ids = (header.flags & kIds) != 0;
  if (header.flags & kSensor) scan.sensor_model = {header.min_range, header.max_range, header.height};
  scan.stamp = header.stamp;
  PlaneReader reader(body);
  reader.readDifferences(scan.points, header.points);
  reader.read(scan.labels, header.points);
  reader.readDifferences(scan.no_returns, header.no_returns);
  if (header.flags & kSoft) {
    reader.read(scan.soft_counts, header.points);
    reader.read(scan.soft_ids, header.shares);
    reader.read(scan.soft_shares, header.shares);
    std::size_t classes = 0;
    for (const std::uint8_t count : scan.soft_counts) classes += count;
    if (classes != header.shares) throw ScanDamaged("its points have other numbers of classes than it says");
  }
  return scan;
}

}  // namespace bki_mapping
