// The format of packed scans is in docs/map_file.md. "BKS1" is what earlier versions wrote: it is only read.
#include "journal/scan_codec.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "journal/byte_planes.h"
#include "journal/point_list.h"
#include "journal/zigzag.h"

namespace bki_mapping {
namespace {

constexpr std::uint32_t kMagic1 = 0x31534b42, kMagic = 0x32534b42;  // "BKS1", "BKS2"
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

/// What a packed scan begins with. BKS1 has no lists.
struct Headers {
  Header scan;
  ListHeader hits, directions;
};
static_assert(sizeof(Headers) == 96);

/// Reads a list of points of BKS1: four planes of the differences of each coordinate.
void readDifferences(std::size_t count, PlaneReader& planes, ScanPoints& points) {
  points.resize(count);
  std::vector<std::uint32_t> differences;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    planes.read(differences, count);
    std::int32_t before = 0;
    for (std::size_t n = 0; n < count; ++n) points[n][axis] = before = zigzagFrom(before, differences[n]);
  }
}

/// Bytes of the planes.
std::uint64_t planesSize(const Headers& headers) {
  const Header& scan = headers.scan;
  const bool old = scan.magic == kMagic1;
  const std::uint64_t hit = old ? 16 : headers.hits.bytesOfPoint(),
                      direction = old ? 12 : headers.directions.bytesOfPoint(),
                      soft = scan.flags & kSoft ? scan.points + 3ull * scan.shares : 0;
  return hit * scan.points + soft + direction * scan.no_returns;
}

/// Checks and removes the headers from the beginning of the bytes.
Headers takeHeaders(std::string_view& bytes) {
  Headers headers = {};
  Header& scan = headers.scan;
  if (bytes.size() < sizeof(scan)) throw ScanDamaged("it is too short");
  std::memcpy(&scan, bytes.data(), sizeof(scan));
  if (scan.magic != kMagic && scan.magic != kMagic1) throw ScanDamaged("it does not begin as a scan");
  const std::size_t size = scan.magic == kMagic ? sizeof(headers) : sizeof(scan);
  if (bytes.size() < size || bytes.size() - size != scan.packed_size) {
    throw ScanDamaged("its size is not as it says");
  }
  std::memcpy(&headers, bytes.data(), size);
  bytes.remove_prefix(size);
  const bool known =
      headers.hits.isValid() && headers.directions.isValid() && headers.directions.label_bytes == 0;
  if (scan.magic == kMagic && !known) {
    throw ScanDamaged("its points are stored in a way that is not known");
  }
  if (planesSize(headers) > kMostExpansion * scan.packed_size || scan.points > kMostPoints ||
      scan.no_returns > kMostPoints || scan.shares > kMostPoints) {
    throw ScanDamaged("it claims too many points");
  }
  const bool real = std::isfinite(scan.quantum) && scan.quantum > 0.0 && std::isfinite(scan.min_range) &&
                    std::isfinite(scan.max_range) && std::isfinite(scan.height);
  if (!real) throw ScanDamaged("its numbers are not finite");
  return headers;
}

}  // namespace

std::string packScan(const SensorScan& scan) {
  if (scan.points.size() > kMostPoints || scan.no_returns.size() > kMostPoints ||
      scan.soft_ids.size() > kMostPoints) {
    throw std::length_error("a scan has more points than a journal can hold");
  }
  const bool soft = !scan.soft_counts.empty();
  const std::vector<std::uint32_t> no_labels;
  const PointList hits(scan.points, scan.labels), directions(scan.no_returns, no_labels);
  Headers headers = {};
  headers.hits = hits.header();
  headers.directions = directions.header();
  Header& header = headers.scan;
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
  PlaneWriter planes(planesSize(headers));
  hits.write(planes);
  directions.write(planes);
  if (soft) {
    planes.write(scan.soft_counts.size(), 1, [&](std::size_t n) { return scan.soft_counts[n]; });
    planes.write(scan.soft_ids.size(), 1, [&](std::size_t n) { return scan.soft_ids[n]; });
    planes.write(scan.soft_shares.size(), 2, [&](std::size_t n) { return scan.soft_shares[n]; });
  }
  const std::string packed = planes.packed();
  header.packed_size = static_cast<std::uint32_t>(packed.size());
  std::string bytes(reinterpret_cast<const char*>(&headers), sizeof(headers));
  return bytes += packed;
}

SensorScan unpackScan(std::string_view bytes) {
  const Headers headers = takeHeaders(bytes);
  const Header& header = headers.scan;
  const std::optional<std::string> body = unpackedPlanes(bytes, planesSize(headers));
  if (!body) throw ScanDamaged("its points cannot be unpacked");
  SensorScan scan;
  scan.quantum = header.quantum;
  scan.labels_are_ids = (header.flags & kIds) != 0;
  if (header.flags & kSensor) scan.sensor_model = {header.min_range, header.max_range, header.height};
  scan.stamp = header.stamp;
  PlaneReader planes(*body);
  if (header.magic == kMagic1) {
    readDifferences(header.points, planes, scan.points);
    planes.read(scan.labels, header.points);
    readDifferences(header.no_returns, planes, scan.no_returns);
  } else {
    readList(headers.hits, header.points, planes, scan.points, &scan.labels);
    readList(headers.directions, header.no_returns, planes, scan.no_returns, nullptr);
  }
  if (header.flags & kSoft) {
    planes.read(scan.soft_counts, header.points);
    planes.read(scan.soft_ids, header.shares);
    planes.read(scan.soft_shares, header.shares);
    std::size_t classes = 0;
    for (const std::uint8_t count : scan.soft_counts) classes += count;
    if (classes != header.shares) throw ScanDamaged("its points have other numbers of classes than it says");
  }
  return scan;
}

}  // namespace bki_mapping
