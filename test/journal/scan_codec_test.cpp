// Packed scans: nothing is lost, few bytes are taken, damaged ones are refused.
#include "journal/scan_codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "journal/sensor_scan.h"
#include "journal/some_scan.h"

namespace bki_mapping {
namespace {

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

TEST(ScanCodec, TakesFewBytesForTheRowsOfALidar) {
  SensorScan scan;
  scan.quantum = kQuantum;
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 1000; ++column) {
      const double azimuth = column * 2e-3 * 3.14159, range = 10.0 + 5.0 * std::sin(3.0 * azimuth);
      const auto quanta = [](double metres) {
        return static_cast<std::int32_t>(std::lround(metres / kQuantum));
      };
      scan.points.push_back({quanta(range * std::cos(azimuth)), quanta(range * std::sin(azimuth)),
                             quanta(range * std::tan(0.03 * (row - 8)))});
      scan.labels.push_back(column < 500 ? 40 : 50);
    }
  }
  EXPECT_LT(packScan(scan).size(), 2 * scan.points.size());
}

TEST(ScanCodec, RefusesDamagedBytes) {
  const std::string good =
      packScan(toSensorScan(someScan(somePose(8), 9, true), somePose(8), kQuantum, {}).scan);
  std::mt19937 random(10);
  int refused = 0;
  for (int n = 0; n < 2000; ++n) {
    std::string bad = good;
    const std::size_t at = random() % (n % 2 ? 64 : bad.size());
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
  std::string greedy = good;  // claims four billion points
  for (int byte = 48; byte < 52; ++byte) greedy[static_cast<std::size_t>(byte)] = '\xff';
  EXPECT_THROW(unpackScan(greedy), ScanDamaged);
}

}  // namespace
}  // namespace bki_mapping
