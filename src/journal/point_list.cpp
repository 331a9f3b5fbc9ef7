#include "journal/point_list.h"

#include <utility>

#include "journal/zigzag.h"

namespace bki_mapping {
namespace {

constexpr int kLowBits = 4, kLowMask = 15;

PointErrors errorsOf(const ScanPoints& points, const PointOrder& order) {
  PointErrors errors;
  errors.first.resize(points.size());
  errors.low.resize(points.size());
  errors.second.resize(points.size());
  errors.third.resize(points.size());
  SensorScan::Coordinates before = {0, 0, 0};
  for (std::size_t n = 0; n < points.size(); ++n) {
    const SensorScan::Coordinates& point = points[order.at(n)];
    NextPoint next(before, order.step);
    const auto [a, b, c] = next.axes();
    errors.first[n] = zigzagBetween(next.first(), point[a]);
    next.setFirst(point[a]);
    const std::uint32_t second = zigzagBetween(next.other(b), point[b]),
                        third = zigzagBetween(next.other(c), point[c]);
    errors.low[n] = static_cast<std::uint8_t>((second & kLowMask) | (third & kLowMask) << kLowBits);
    errors.second[n] = second >> kLowBits;
    errors.third[n] = third >> kLowBits;
    before = point;
  }
  return errors;
}

/// The largest number of bytes that any of the numbers needs.
std::uint8_t mostBytes(const std::vector<std::uint32_t>& numbers) {
  std::uint32_t bits = 0;
  for (const std::uint32_t n : numbers) bits |= n;
  return static_cast<std::uint8_t>(byteCount(bits));
}

}  // namespace

PointList::PointList(const ScanPoints& points, const std::vector<std::uint32_t>& labels)
    : labels_(labels), order_(chooseOrder(points)), errors_(errorsOf(points, order_)) {
  header_.cosine = order_.step.cosine;
  header_.sine = order_.step.sine;
  header_.along_ray = order_.step.along_ray;
  header_.by_rows = !order_.rows.empty();
  header_.bytes[0] = mostBytes(errors_.first);
  header_.bytes[1] = mostBytes(errors_.second);
  header_.bytes[2] = mostBytes(errors_.third);
  header_.label_bytes = mostBytes(labels_);
}

void PointList::write(PlaneWriter& planes) const {
  const auto write = [&](const auto& values, int bytes) {
    planes.write(values.size(), bytes, [data = values.data()](std::size_t n) { return data[n]; });
  };
  std::uint8_t before = 0;
  planes.write(order_.rows.size(), 1, [&](std::size_t n) {
    return static_cast<std::uint8_t>(order_.rows[n] - std::exchange(before, order_.rows[n]));
  });
  write(errors_.first, header_.bytes[0]);
  write(errors_.low, 1);
  write(errors_.second, header_.bytes[1]);
  write(errors_.third, header_.bytes[2]);
  planes.write(labels_.size(), header_.label_bytes, [&](std::size_t n) { return labels_[order_.at(n)]; });
}

void readList(const ListHeader& header, std::size_t count, PlaneReader& planes, ScanPoints& points,
              std::vector<std::uint32_t>* labels) {
  PointOrder order;
  order.step = header.step();
  if (header.by_rows) {
    planes.read(order.rows, count);
    std::uint8_t row = 0;
    for (std::uint8_t& number : order.rows) number = row = static_cast<std::uint8_t>(row + number);
    order.points = rowByRow(order.rows);
  }
  PointErrors errors;
  planes.read(errors.first, count, header.bytes[0]);
  planes.read(errors.low, count);
  planes.read(errors.second, count, header.bytes[1]);
  planes.read(errors.third, count, header.bytes[2]);
  points.resize(count);
  SensorScan::Coordinates before = {0, 0, 0};
  for (std::size_t n = 0; n < count; ++n) {
    NextPoint next(before, order.step);
    const auto [a, b, c] = next.axes();
    before[a] = zigzagFrom(next.first(), errors.first[n]);
    next.setFirst(before[a]);
    const auto error = [low = errors.low[n]](int bits, std::uint32_t high) {
      return (static_cast<std::uint32_t>(low) >> bits & kLowMask) | high << kLowBits;
    };
    before[b] = zigzagFrom(next.other(b), error(0, errors.second[n]));
    before[c] = zigzagFrom(next.other(c), error(kLowBits, errors.third[n]));
    points[order.at(n)] = before;
  }
  if (!labels) return;
  std::vector<std::uint32_t> stored;
  planes.read(stored, count, header.label_bytes);
  labels->resize(count);
  for (std::size_t n = 0; n < count; ++n) (*labels)[order.at(n)] = stored[n];
}

}  // namespace bki_mapping
