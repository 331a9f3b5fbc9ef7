#include "store/journal_rows.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "store/tile_rows.h"

namespace bki_mapping {
namespace {

constexpr std::uint64_t kMostStamp = std::numeric_limits<std::int64_t>::max();
/// So that there are numbers above it.
constexpr std::uint64_t kMostNumber = std::uint64_t{1} << 62;

/// The largest packed scan [bytes]: below the largest value that a Database takes.
constexpr std::size_t kMostContent = 250'000'000;

/// Coordinates of poses and ranges beyond this are no places [m].
constexpr double kFarthest = 1e12;

/// The 3x4 matrix, row by row, as doubles in little-endian order.
std::string bytesOf(const Eigen::Isometry3d& pose) {
  std::string bytes;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) {
      std::uint64_t bits;
      const double value = pose(row, column);
      std::memcpy(&bits, &value, sizeof bits);
      for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<char>(bits >> 8 * i & 0xff));
    }
  }
  return bytes;
}

Eigen::Isometry3d poseOf(const std::string& bytes, const std::string& name) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  if (bytes.size() != 96) throw damaged(name, "the pose of a scan is not 12 numbers");
  for (std::size_t n = 0; n < 12; ++n) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < 8; ++i) {
      bits |= std::uint64_t{static_cast<unsigned char>(bytes[8 * n + i])} << 8 * i;
    }
    double value;
    std::memcpy(&value, &bits, sizeof value);
    pose(static_cast<Eigen::Index>(n / 4), static_cast<Eigen::Index>(n % 4)) = value;
  }
  return pose;
}

bool isPose(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d rotation = pose.linear();
  return rotation.allFinite() && pose.translation().allFinite() &&
         pose.translation().cwiseAbs().maxCoeff() < kFarthest &&
         (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-3;
}

/// Differences of the coordinates, zigzag, seven bits a byte, the lowest first.
std::string bytesOf(const std::vector<GridIndex>& tiles) {
  std::string bytes;
  GridIndex last{};
  const auto put = [&](std::int64_t from, std::int64_t to) {
    const std::int64_t difference = to - from;
    auto rest = static_cast<std::uint64_t>(difference) << 1 ^ static_cast<std::uint64_t>(difference >> 63);
    for (; rest > 0x7f; rest >>= 7) bytes.push_back(static_cast<char>(0x80 | (rest & 0x7f)));
    bytes.push_back(static_cast<char>(rest));
  };
  for (const GridIndex& tile : tiles) {
    put(last.x, tile.x);
    put(last.y, tile.y);
    put(last.z, tile.z);
    last = tile;
  }
  return bytes;
}

std::vector<GridIndex> tilesFrom(const std::string& bytes, const std::string& name) {
  std::size_t next = 0;
  const auto take = [&](std::int64_t from) {
    std::uint64_t rest = 0;
    for (int shift = 0;; shift += 7) {
      if (next == bytes.size() || shift > 28) throw damaged(name, "the tiles of a scan are cut off");
      const auto byte = static_cast<unsigned char>(bytes[next++]);
      rest |= std::uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) break;
    }
    const std::int64_t to = from + static_cast<std::int64_t>(rest >> 1 ^ (0 - (rest & 1)));
    if (std::abs(to) > std::numeric_limits<std::int32_t>::max()) {
      throw damaged(name, "a tile of a scan is out of range");
    }
    return static_cast<std::int32_t>(to);
  };
  std::vector<GridIndex> tiles;
  for (GridIndex last{}; next < bytes.size(); tiles.push_back(last)) {
    last = {take(last.x), take(last.y), take(last.z)};
  }
  return tiles;
}

std::uint32_t checksumOf(const std::string& content) {
  return static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size()));
}

/// Columns of a scan that are not members of a ScanRecord.
struct ScanRow {
  std::string pose, odometry, tiles;
  std::uint64_t bytes = 0;     ///< of the content
  std::uint32_t checksum = 0;  ///< of the content
};

template <typename Visit, typename Scan, typename Row>
void visitScan(Visit& visit, Scan& scan, Row& row) {
  visit(scan.number);
  visit(scan.drive);
  visit(scan.stamp);
  visit(scan.sensor);
  visit(scan.settings);
  visit(scan.cleared);
  visit(scan.jump);
  visit(scan.reach);
  visit.blob(row.pose);
  visit.blob(row.odometry);
  visit.blob(row.tiles);
  visit(row.bytes);
  visit(row.checksum);
}

constexpr char kColumns[] =
    "number, drive, stamp, sensor, settings, cleared, jump, reach, pose, odometry, tiles, bytes, "
    "content_checksum, checksum";

/// Reads a row, and adds it to the totals.
ScanRecord readRow(RowReader& reader, const std::string& name, ScanRow& row, std::int64_t& checksums) {
  ScanRecord scan;
  visitScan(reader, scan, row);
  checksums += reader.finish();
  scan.T_map_sensor = poseOf(row.pose, name);
  scan.T_odometry_sensor = poseOf(row.odometry, name);
  scan.tiles = tilesFrom(row.tiles, name);
  scan.bytes = row.bytes;
  try {
    checkScan(scan);
  } catch (const std::invalid_argument& error) {
    throw damaged(name, error.what());
  }
  return scan;
}

/// The row of a scan, if there is one. @param[in,out] checksums its checksum is added.
std::optional<ScanRecord> findRow(Database& database, std::uint64_t number, ScanRow& row,
                                  std::int64_t& checksums) {
  Statement select =
      database.prepare((std::string("SELECT ") + kColumns + " FROM scan WHERE number = ?").c_str());
  select.bind(0, static_cast<std::int64_t>(number));
  if (!select.step()) return std::nullopt;
  RowReader reader(select, database.name());
  return readRow(reader, database.name(), row, checksums);
}

std::uint32_t bindScan(RowWriter& writer, const ScanRecord& scan, ScanRow& row) {
  row.pose = bytesOf(scan.T_map_sensor);
  row.odometry = bytesOf(scan.T_odometry_sensor);
  row.tiles = bytesOf(scan.tiles);
  const ScanRow& constant = row;
  visitScan(writer, scan, constant);
  return writer.finish();
}

template <typename Visit, typename Number, typename Text>
void visitSettings(Visit& visit, Number& number, Text& parameters) {
  visit(number);
  visit(parameters);
}

template <typename Visit, typename Number, typename Corner>
void visitCleared(Visit& visit, Number& number, Corner& low, Corner& high) {
  visit(number);
  for (auto& coordinate : low) visit(coordinate);
  for (auto& coordinate : high) visit(coordinate);
}

using Corner = std::array<double, 3>;

/// Calls use(RowReader&) for each row of a small table, by number, which count from 0; at most `most` rows
/// and one more.
template <typename Use>
void forEachRow(Database& database, const char* select_rows, std::int64_t most, const Use& use) {
  Statement select = database.prepare(select_rows);
  std::int64_t text_left = database.mostContent();
  for (std::int64_t rows = 0; rows <= most && select.step(); ++rows) {
    RowReader row(select, database.name());
    if (use(row) != rows) throw damaged(database.name(), "rows of its journal are missing");
    text_left -= row.textSize();
    if (text_left < 0) throw damaged(database.name(), "rows of its journal share their texts");
  }
}

template <typename Use>
void forEachSettings(Database& database, std::int64_t most, const Use& use) {
  forEachRow(database, "SELECT * FROM settings ORDER BY number", most, [&](RowReader& row) {
    std::int64_t number = 0;
    std::string parameters;
    visitSettings(row, number, parameters);
    use(std::move(parameters), row.finish());
    return number;
  });
}

template <typename Use>
void forEachCleared(Database& database, std::int64_t most, const Use& use) {
  forEachRow(database, "SELECT * FROM cleared ORDER BY number", most, [&](RowReader& row) {
    std::int64_t number = 0;
    Corner low, high;
    visitCleared(row, number, low, high);
    const std::uint32_t checksum = row.finish();
    const Eigen::AlignedBox3d box(Eigen::Vector3d(low.data()), Eigen::Vector3d(high.data()));
    if (box.min().hasNaN() || box.max().hasNaN())
      throw damaged(database.name(), "a cleared box is not a box");
    use(box, checksum);
    return number;
  });
}

}  // namespace

void readJournal(Database& database, const Totals& expected, Totals& found) {
  forEachSettings(database, expected.settings, [&](const std::string&, std::uint32_t checksum) {
    found.checksums += checksum;
    ++found.settings;
  });
  forEachCleared(database, expected.cleared, [&](const Eigen::AlignedBox3d&, std::uint32_t checksum) {
    found.checksums += checksum;
    ++found.cleared;
  });
  Statement select =
      database.prepare((std::string("SELECT ") + kColumns + " FROM scan ORDER BY number").c_str());
  std::int64_t last = -1, text_left = database.mostContent();
  while (found.scans <= expected.scans && select.step()) {
    RowReader reader(select, database.name());
    ScanRow row;
    const ScanRecord scan = readRow(reader, database.name(), row, found.checksums);
    const auto number = static_cast<std::int64_t>(scan.number);
    if (row.bytes > static_cast<std::uint64_t>(database.mostContent())) {
      throw damaged(database.name(), "a scan of its journal is larger than the file");
    }
    text_left -= reader.textSize() + static_cast<std::int64_t>(row.bytes);
    if (number <= last) throw damaged(database.name(), "its list of scans is out of order");
    if (text_left < 0) throw damaged(database.name(), "scans of its journal share their texts");
    if (scan.settings >= expected.settings || scan.cleared > expected.cleared) {
      throw damaged(database.name(), "a scan refers to settings or boxes that it does not have");
    }
    last = number;
    ++found.scans;
  }
}

std::vector<ScanRecord> readScans(Database& database) {
  Statement select =
      database.prepare((std::string("SELECT ") + kColumns + " FROM scan ORDER BY number").c_str());
  std::vector<ScanRecord> scans;
  std::int64_t ignored = 0;
  while (select.step()) {
    RowReader reader(select, database.name());
    ScanRow row;
    scans.push_back(readRow(reader, database.name(), row, ignored));
  }
  return scans;
}

std::uint64_t readNextNumber(Database& database) {
  Statement select = database.prepare("SELECT max(number) FROM scan");
  if (!select.step() || select.isNull(0)) return 0;
  return static_cast<std::uint64_t>(select.integer(0)) + 1;
}

std::string readScanContent(Database& database, std::uint64_t number) {
  Statement select = database.prepare(
      "SELECT bytes, content_checksum, content FROM scan JOIN scan_content USING (number) WHERE number = ?");
  select.bind(0, static_cast<std::int64_t>(number));
  if (!select.step()) throw damaged(database.name(), "scan " + std::to_string(number) + " is missing");
  const Statement::Bytes bytes = select.bytes(2);
  std::string content(reinterpret_cast<const char*>(bytes.data), bytes.size);
  if (select.integer(0) != static_cast<std::int64_t>(content.size()) ||
      select.integer(1) != std::int64_t{checksumOf(content)}) {
    throw damaged(database.name(), "the checksum of scan " + std::to_string(number) + " is wrong");
  }
  return content;
}

void insertScan(Database& database, const ScanRecord& scan, const std::string& content, Totals& totals) {
  checkScan(scan);
  if (content.size() > kMostContent) {
    throw std::invalid_argument("the points of scan " + std::to_string(scan.number) + " take " +
                                std::to_string(content.size()) + " bytes, and a map file holds at most " +
                                std::to_string(kMostContent) + " of a scan");
  }
  Statement insert = database.prepare("INSERT INTO scan VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
  RowWriter writer(insert);
  ScanRow row;
  row.bytes = content.size();
  row.checksum = checksumOf(content);
  const std::uint32_t checksum = bindScan(writer, scan, row);
  insert.step();
  Statement insert_content = database.prepare("INSERT INTO scan_content VALUES (?,?)");
  insert_content.bind(0, static_cast<std::int64_t>(scan.number));
  insert_content.bindBytes(1, content);
  insert_content.step();
  totals.checksums += checksum;
  ++totals.scans;
}

void updateScan(Database& database, const ScanRecord& scan, Totals& totals) {
  checkScan(scan);
  ScanRow row;
  std::int64_t checksum = 0;
  if (!findRow(database, scan.number, row, checksum)) {
    throw std::invalid_argument("the journal of " + database.name() + " has no scan " +
                                std::to_string(scan.number));
  }
  Statement update = database.prepare(
      "UPDATE scan SET number=?, drive=?, stamp=?, sensor=?, settings=?, cleared=?, jump=?, reach=?, pose=?, "
      "odometry=?, tiles=?, bytes=?, content_checksum=?, checksum=? WHERE number=?");
  RowWriter writer(update);
  totals.checksums += std::int64_t{bindScan(writer, scan, row)} - checksum;
  update.bind(14, static_cast<std::int64_t>(scan.number));
  update.step();
}

std::vector<std::string> readSettings(Database& database) {
  std::vector<std::string> settings;
  forEachSettings(database, std::numeric_limits<std::int32_t>::max(),
                  [&](std::string parameters, std::uint32_t) { settings.push_back(std::move(parameters)); });
  return settings;
}

void insertSettings(Database& database, const std::string& parameters, Totals& totals) {
  Statement insert = database.prepare("INSERT INTO settings VALUES (?,?,?)");
  RowWriter writer(insert);
  visitSettings(writer, totals.settings, parameters);
  totals.checksums += writer.finish();
  insert.step();
  ++totals.settings;
}

std::vector<Eigen::AlignedBox3d> readCleared(Database& database) {
  std::vector<Eigen::AlignedBox3d> boxes;
  forEachCleared(database, std::numeric_limits<std::int32_t>::max(),
                 [&](const Eigen::AlignedBox3d& box, std::uint32_t) { boxes.push_back(box); });
  return boxes;
}

void insertCleared(Database& database, const Eigen::AlignedBox3d& box, Totals& totals) {
  Statement insert = database.prepare("INSERT INTO cleared VALUES (?,?,?,?,?,?,?,?)");
  RowWriter writer(insert);
  const Corner low{box.min().x(), box.min().y(), box.min().z()};
  const Corner high{box.max().x(), box.max().y(), box.max().z()};
  visitCleared(writer, totals.cleared, low, high);
  totals.checksums += writer.finish();
  insert.step();
  ++totals.cleared;
}

void eraseJournal(Database& database, Totals& totals) {
  Totals found;
  readJournal(database, totals, found);
  for (const char* table : {"scan", "scan_content", "settings", "cleared"}) {
    database.run((std::string("DELETE FROM ") + table).c_str());
  }
  totals.checksums -= found.checksums;
  totals.scans = totals.settings = totals.cleared = 0;
}

void checkScan(const ScanRecord& scan) {
  checkText("the drive of a scan", scan.drive);
  checkText("the sensor of a scan", scan.sensor);
  if (scan.number > kMostNumber || scan.stamp > kMostStamp) {
    throw std::invalid_argument("the number of a scan is above 2^62, or its stamp 2^63 or more");
  }
  for (std::size_t n = 0; n < scan.tiles.size(); ++n) {
    const GridIndex& tile = scan.tiles[n];
    const std::int64_t farthest = std::max(
        {std::abs(std::int64_t{tile.x}), std::abs(std::int64_t{tile.y}), std::abs(std::int64_t{tile.z})});
    if (farthest > kMostTileIndex || (n > 0 && !(scan.tiles[n - 1] < tile))) {
      throw std::invalid_argument("the tiles of scan " + std::to_string(scan.number) +
                                  " are not sorted, or out of range");
    }
  }
  if (scan.settings < 0 || scan.cleared < 0 || !(scan.reach >= 0.0) || !(scan.reach < kFarthest)) {
    throw std::invalid_argument("a number of scan " + std::to_string(scan.number) + " is out of range");
  }
  if (!isPose(scan.T_map_sensor) || !isPose(scan.T_odometry_sensor)) {
    throw std::invalid_argument("a pose of scan " + std::to_string(scan.number) + " is no pose");
  }
}

}  // namespace bki_mapping
