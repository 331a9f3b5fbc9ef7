// Packed scans: nothing is lost, few bytes are taken, damaged ones are refused.
#include "journal/scan_codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <set>

#include "core/pi.h"
#include "journal/byte_planes.h"
#include "journal/point_order.h"
#include "journal/sensor_scan.h"
#include "journal/some_scan.h"

namespace bki_mapping {
namespace {

/// The orders in which drivers of lidars send their points.
enum class Sent { kByRows, kByColumns, kInterleaved };

/// What a lidar with 16 rows sees, with a noise of 2 cm; above the horizon, many beams do not return.
SensorScan lidarScan(Sent sent, int columns) {
  SensorScan scan;
  scan.quantum = kQuantum;
  std::mt19937 random(11);
  std::normal_distribution<double> noise(0.0, 2.0);
  const auto add = [&](int row, int column) {
    if (row > 8 && random() % 4 == 0) return;
    const double azimuth = 2.0 * kPi * column / columns, elevation = (2 * row - 15) * kPi / 180.0;
    const double wall = 1000.0 + 500.0 * std::sin(3.0 * azimuth), ground = 170.0 / std::sin(-elevation);
    const double range = (elevation < 0.0 ? std::min(wall, ground) : wall) + noise(random);
    const auto quanta = [&](double part) { return static_cast<std::int32_t>(std::lround(range * part)); };
    scan.points.push_back({quanta(std::cos(elevation) * std::cos(azimuth)),
                           quanta(std::cos(elevation) * std::sin(azimuth)), quanta(std::sin(elevation))});
    scan.labels.push_back(row < 4 ? 40 : azimuth < kPi ? 50 : 7 << 16 | 10);
  };
  if (sent == Sent::kByRows) {
    for (int row = 0; row < 16; ++row)
      for (int column = 0; column < columns; ++column) add(row, column);
  } else {
    for (int column = 0; column < columns; ++column)
      for (int n = 0; n < 16; ++n) add(sent == Sent::kByColumns ? n : n % 2 * 8 + n / 2, column);
  }
  return scan;
}

std::string keptBytes(const std::string& name) {
  std::ifstream file(BKI_MAPPING_SOURCE_DIR "/test/journal/data/" + name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(ScanCodec, UnpacksWhatItPacks) {
  for (const bool soft : {false, true}) {
    SensorScan scan = toSensorScan(someScan(somePose(6), 7, soft), somePose(6), kQuantum, {}).scan;
    EXPECT_EQ(unpackScan(packScan(scan)), scan);
    scan.sensor_model = SensorModelConfig{0.5, 80.0, 1.7};
    scan.points.push_back(
        {std::numeric_limits<std::int32_t>::max(), std::numeric_limits<std::int32_t>::min(), 0});
    scan.labels.push_back(0xffffffffu);
    if (soft) scan.soft_counts.push_back(0);
    EXPECT_EQ(unpackScan(packScan(scan)), scan);
  }
  SensorScan without_points;
  without_points.quantum = 0.1;
  EXPECT_EQ(unpackScan(packScan(without_points)), without_points);
}

TEST(ScanCodec, KeepsTheOrderOfPointsHoweverTheyAreSent) {
  for (const Sent sent : {Sent::kByRows, Sent::kByColumns, Sent::kInterleaved}) {
    SensorScan scan = lidarScan(sent, 500);
    scan.no_returns = lidarScan(sent, 50).points;
    EXPECT_EQ(chooseOrder(scan.points).rows.empty(), sent == Sent::kByRows);
    EXPECT_TRUE(chooseOrder(scan.points).step.along_ray);
    EXPECT_EQ(unpackScan(packScan(scan)), scan);
    for (std::size_t n = 0; n < scan.points.size(); n += 7) scan.points[n] = {0, 0, 0};
    EXPECT_EQ(unpackScan(packScan(scan)), scan) << "points from which no direction follows";
    constexpr auto kLeast = std::numeric_limits<std::int32_t>::min(),
                   kMost = std::numeric_limits<std::int32_t>::max();
    for (std::size_t n = 0; n < scan.points.size(); n += 5) {
      const auto extreme = [n](unsigned axis) {
        const std::int32_t all[] = {kLeast, -1, 0, kMost};
        return all[n >> (2 * axis) & 3];
      };
      scan.points[n] = {extreme(0), extreme(1), extreme(2)};
    }
    EXPECT_EQ(unpackScan(packScan(scan)), scan) << "the largest numbers";
  }
}

TEST(ScanCodec, ChoosesRowsOnlyIfTheyHelp) {
  SensorScan scan = lidarScan(Sent::kByColumns, 500);
  const PointOrder order = chooseOrder(scan.points);
  const auto all = std::set<std::uint8_t>(order.rows.begin(), order.rows.end());
  EXPECT_EQ(all.size(), 16u);
  EXPECT_NEAR(order.step.sine, PointStep::kOne * std::sin(2.0 * kPi / 500), 0.05 * order.step.sine);
  std::shuffle(scan.points.begin(), scan.points.end(), std::mt19937(12));
  EXPECT_TRUE(chooseOrder(scan.points).rows.empty());
  SensorScan many;  // more rows than have numbers
  for (int column = 0; column < 100; ++column)
    for (int row = 0; row < 400; ++row) many.points.push_back({100'000, 100 * column, 200 * row - 40'000});
  many.labels.resize(many.points.size());
  many.quantum = kQuantum;
  EXPECT_EQ(unpackScan(packScan(many)), many);
}

TEST(ScanCodec, TakesFewBytesForTheRowsOfALidar) {
  std::vector<std::size_t> sizes;
  for (const Sent sent : {Sent::kByRows, Sent::kByColumns, Sent::kInterleaved}) {
    const SensorScan scan = lidarScan(sent, 1000);
    sizes.push_back(packScan(scan).size());
    EXPECT_LT(10 * sizes.back(), 14 * scan.points.size());
  }
  EXPECT_LT(10 * sizes[1], 13 * sizes[0]) << "of columns, only the numbers of rows are added";
}

TEST(ScanCodec, ReadsWhatOtherVersionsAndMachinesWrote) {
  const SensorScan old = unpackScan(keptBytes("bks1.scan")), scan = unpackScan(keptBytes("bks2.scan"));
  EXPECT_EQ(old, scan);
  ASSERT_EQ(scan.points.size(), 856u);
  EXPECT_EQ(scan.points.front(), (SensorScan::Coordinates{635, 0, -170}));
  EXPECT_EQ(scan.points.back(), (SensorScan::Coordinates{822, -86, 161}));
  EXPECT_EQ(scan.labels.back(), 7u << 16 | 10);
  EXPECT_EQ(scan.no_returns.size(), 100u);
  EXPECT_EQ(scan.soft_ids.size(), 855u);
  EXPECT_EQ(scan.stamp, 123456789u);
  ASSERT_TRUE(scan.sensor_model);
  EXPECT_EQ(scan.sensor_model->max_range, 80.0);
}

TEST(ScanCodec, RefusesDamagedBytes) {
  const std::string good =
      packScan(toSensorScan(someScan(somePose(8), 9, true), somePose(8), kQuantum, {}).scan);
  std::mt19937 random(10);
  int refused = 0;
  for (int n = 0; n < 2000; ++n) {
    std::string bad = good;
    const std::size_t at = random() % (n % 2 ? 96 : bad.size());
    bad[at] = static_cast<char>(bad[at] ^ (1 << random() % 8));
    if (n % 5 == 0) bad.resize(random() % bad.size());
    try {
      unpackScan(bad);
    } catch (const ScanDamaged&) {
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000) << "what the header says of the sensor may be anything";
  EXPECT_THROW(unpackScan(""), ScanDamaged);
  const auto changed = [&good](std::size_t at, char byte) {
    std::string bytes = good;
    bytes[at] = byte;
    return bytes;
  };
  for (const std::size_t list : {64u, 80u}) {
    EXPECT_THROW(unpackScan(changed(list + 3, '\x7f')), ScanDamaged) << "a cosine of 2000";
    EXPECT_THROW(unpackScan(changed(list + 7, '\x80')), ScanDamaged) << "a sine of -2048";
    for (std::size_t at = 8; at < 14; ++at)
      EXPECT_THROW(unpackScan(changed(list + at, '\x05')), ScanDamaged) << at;
  }
  std::string greedy = good;  // claims four billion points
  for (int byte = 48; byte < 52; ++byte) greedy[static_cast<std::size_t>(byte)] = '\xff';
  EXPECT_THROW(unpackScan(greedy), ScanDamaged);
}

TEST(ScanCodec, SurvivesAnyPlanes) {
  std::mt19937 random(13);
  const auto put = [](std::string& bytes, std::size_t at, std::uint32_t number) {
    for (int byte = 0; byte < 4; ++byte) bytes[at++] = static_cast<char>(number >> (8 * byte) & 0xff);
  };
  for (int n = 0; n < 500; ++n) {
    std::string bytes = packScan(SensorScan{0.01, {}, {}, false, {}, {}, {}, {}, {}, 0}).substr(0, 96);
    std::size_t size = 0;
    for (const std::size_t list : {0u, 1u}) {
      const auto points = static_cast<std::uint32_t>(random() % 100);
      put(bytes, list == 0 ? 48 : 56, points);
      std::size_t of_point = 1;
      const std::size_t header = 64 + 16 * list;
      put(bytes, header, static_cast<std::uint32_t>(PointStep::kOne) * (random() % 2 ? 1u : -1u));
      put(bytes, header + 4, static_cast<std::uint32_t>(random() % PointStep::kOne));
      bytes[header + 8] = static_cast<char>(random() % 2);
      for (std::size_t at = 9; at < 14; ++at) {
        const std::size_t planes = random() % (at == 9 ? 2 : 5);
        bytes[header + at] = static_cast<char>(planes);
        of_point += planes;
      }
      if (list == 1) {
        of_point -= static_cast<std::size_t>(bytes[header + 13]);
        bytes[header + 13] = 0;
      }
      size += points * of_point;
    }
    PlaneWriter planes(size);
    planes.write(size, 1, [&](std::size_t) { return random() % 3 ? random() : 0u; });
    const std::string packed = planes.packed();
    put(bytes, 60, static_cast<std::uint32_t>(packed.size()));
    const SensorScan scan = unpackScan(bytes + packed);
    EXPECT_EQ(scan.labels.size(), scan.points.size());
    EXPECT_EQ(unpackScan(packScan(scan)), scan);
  }
}

}  // namespace
}  // namespace bki_mapping
