#include "store/records.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "core/frame_name.h"
#include "store/schema.h"

namespace bki_mapping {
namespace {

constexpr std::size_t kLongestText = 1'000'000;

std::string rawText(const std::vector<std::uint32_t>& raw) {
  std::string text;
  for (const std::uint32_t label : raw) text += (text.empty() ? "" : " ") + std::to_string(label);
  return text;
}

std::vector<std::uint32_t> parseRaw(const std::string& text, const std::string& name) {
  std::vector<std::uint32_t> raw;
  const char *next = text.data(), *const end = next + text.size();
  while (next != end) {
    const auto [after, error] = std::from_chars(next, end, raw.emplace_back());
    if (error != std::errc() || (after != end && *after != ' ')) {
      throw damaged(name, "the raw labels of a class are not numbers");
    }
    next = after == end ? end : after + 1;
  }
  return raw;
}

// The functions below visit the columns of each table in order, for writing (const rows) and for reading.

template <typename Visit, typename Info, typename Table>
void visitMap(Visit& visit, std::int64_t version, Info& info, Table& table) {
  visit(info.resolution);
  visit(info.unit_exponent);
  visit(info.prior);
  visit(info.frame);
  visit(table.name);
  if (version > 1) visit(table.label_mask);
  visit(info.parameters);
  visit(info.program);
}

/// Whether objects of a class move: the values of the column `dynamic`.
enum Mobility : std::uint8_t { kStays, kDynamic, kLiving };

template <typename Visit, typename Class, typename Position, typename Text, typename Number>
void visitClass(Visit& visit, Class& c, Position& position, Text& raw, Number& mobility) {
  visit(position);
  visit(c.id);
  visit(c.name);
  for (auto& channel : c.color) visit(channel);
  visit(raw);
  visit(c.any_raw);
  visit(c.unlabelled);
  visit(mobility);
  visit(c.ground);
  visit(c.ignored);
  visit(c.free_gain);
}

template <typename Visit, typename Drive, typename Corner>
void visitDrive(Visit& visit, Drive& drive, Corner& low, Corner& high) {
  visit(drive.id);
  visit(drive.name);
  visit(drive.part);
  visit(drive.scans);
  visit(drive.first_stamp);
  visit(drive.last_stamp);
  for (auto& coordinate : low) visit(coordinate);
  for (auto& coordinate : high) visit(coordinate);
}

template <typename Visit, typename Row>
void visitTotals(Visit& visit, std::int64_t version, Row& totals) {
  visit(totals.classes);
  visit(totals.drives);
  visit(totals.tiles);
  visit(totals.blocks);
  visit(totals.planes);
  if (version >= kFirstVersionWithJournal) {
    visit(totals.scans);
    visit(totals.settings);
    visit(totals.cleared);
  }
  visit(totals.checksums);
}

using Corner = std::array<double, 3>;

bool isGood(double value) {
  return std::isfinite(value) && value > 0.0;
}

/// Calls visit(RowReader&) for each row of a table. SQLite does not sort them: a hostile file may repeat a
/// row without end, and sorting would take all rows into memory.
template <typename Visit>
void readRows(Database& database, const std::string& table, std::optional<std::int64_t> expected,
              Visit&& visit) {
  Statement select = database.prepare(("SELECT * FROM " + table).c_str());
  std::int64_t rows = 0, text_left = database.mostContent();
  for (; (!expected || rows <= *expected) && select.step(); ++rows) {
    RowReader row(select, database.name());
    visit(row);
    text_left -= row.textSize();
    if (text_left < 0) throw damaged(database.name(), "rows of the table '" + table + "' share their texts");
  }
  if (expected && rows != *expected) {
    throw damaged(database.name(), "the table '" + table + "' has the wrong number of rows");
  }
}

}  // namespace

void RowChecksum::add(std::int64_t value) {
  std::array<Bytef, 8> bytes;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    bytes[i] = static_cast<Bytef>(static_cast<std::uint64_t>(value) >> 8 * i);
  }
  value_ = static_cast<std::uint32_t>(crc32_z(value_, bytes.data(), bytes.size()));
}

void RowChecksum::add(double value) {
  std::int64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  add(bits);
}

void RowChecksum::add(const std::string& value) {
  add(static_cast<std::int64_t>(value.size()));
  value_ =
      static_cast<std::uint32_t>(crc32_z(value_, reinterpret_cast<const Bytef*>(value.data()), value.size()));
}

std::uint32_t RowReader::finish() const {
  if (statement_.integer(column_) != checksum_.value())
    throw damaged(name_, "the checksum of a row is wrong");
  return checksum_.value();
}

std::uint32_t writeMapRow(Database& database, const MapInfo& info, const TableRow& table) {
  Statement insert = database.prepare("INSERT INTO map VALUES (?,?,?,?,?,?,?,?,?)");
  RowWriter row(insert);
  visitMap(row, kFormatVersion, info, table);
  const std::uint32_t checksum = row.finish();
  insert.step();
  return checksum;
}

std::uint32_t readMapRow(Database& database, std::int64_t version, MapInfo& info, TableRow& table) {
  Statement select = database.prepare("SELECT * FROM map");
  if (!select.step()) throw damaged(database.name(), "the table 'map' is empty");
  RowReader row(select, database.name());
  visitMap(row, version, info, table);
  const std::uint32_t checksum = row.finish();
  if (select.step()) throw damaged(database.name(), "the table 'map' has two rows");
  info.frame = frameName(info.frame);
  return checksum;
}

std::uint32_t writeClassRow(Statement& insert, std::int64_t position, const SemanticClass& c) {
  RowWriter row(insert);
  const std::string raw = rawText(c.raw);
  const std::uint8_t mobility = c.living ? kLiving : c.dynamic ? kDynamic : kStays;
  visitClass(row, c, position, raw, mobility);
  const std::uint32_t checksum = row.finish();
  insert.step();
  insert.reset();
  return checksum;
}

std::vector<SemanticClass> readClasses(Database& database, std::int64_t expected, std::int64_t& checksums) {
  std::vector<std::pair<std::int64_t, SemanticClass>> rows;
  readRows(database, "class", expected, [&](RowReader& row) {
    auto& [position, c] = rows.emplace_back();
    std::string raw;
    std::uint8_t mobility = kStays;
    visitClass(row, c, position, raw, mobility);
    checksums += row.finish();
    if (mobility > kLiving) throw damaged(database.name(), "a number is out of range");
    c.dynamic = mobility != kStays;
    c.living = mobility == kLiving;
    c.raw = parseRaw(raw, database.name());
    if (c.free_gain && !isGood(*c.free_gain)) throw damaged(database.name(), "a gain is out of range");
  });
  std::sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<SemanticClass> classes;
  for (auto& row : rows) classes.push_back(std::move(row.second));
  return classes;
}

std::uint32_t writeDriveRow(Statement& insert, const DriveRecord& drive) {
  RowWriter row(insert);
  Corner low, high;
  for (int i = 0; i < 3; ++i) {
    low[static_cast<std::size_t>(i)] = drive.bounds.min()[i];
    high[static_cast<std::size_t>(i)] = drive.bounds.max()[i];
  }
  const Corner &const_low = low, &const_high = high;
  visitDrive(row, drive, const_low, const_high);
  const std::uint32_t checksum = row.finish();
  insert.step();
  insert.reset();
  return checksum;
}

std::vector<DriveRecord> readDrives(Database& database, std::optional<std::int64_t> expected,
                                    std::int64_t& checksums) {
  std::vector<DriveRecord> drives;
  readRows(database, "drive", expected, [&](RowReader& row) {
    DriveRecord& drive = drives.emplace_back();
    Corner low, high;
    visitDrive(row, drive, low, high);
    checksums += row.finish();
    for (int i = 0; i < 3; ++i) {
      drive.bounds.min()[i] = low[static_cast<std::size_t>(i)];
      drive.bounds.max()[i] = high[static_cast<std::size_t>(i)];
    }
    try {
      checkDrive(drive);
    } catch (const std::invalid_argument& error) {
      throw damaged(database.name(), error.what());
    }
  });
  std::sort(drives.begin(), drives.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  const auto same = [](const DriveRecord& a, const DriveRecord& b) { return a.id == b.id; };
  if (std::adjacent_find(drives.begin(), drives.end(), same) != drives.end()) {
    throw damaged(database.name(), "it holds a drive twice");
  }
  return drives;
}

void writeTotals(Database& database, std::int64_t version, const Totals& totals) {
  database.run("DELETE FROM total");
  Statement insert =
      database.prepare(version >= kFirstVersionWithJournal ? "INSERT INTO total VALUES (?,?,?,?,?,?,?,?,?,?)"
                                                           : "INSERT INTO total VALUES (?,?,?,?,?,?,?)");
  RowWriter row(insert);
  visitTotals(row, version, totals);
  row.finish();
  insert.step();
}

Totals readTotals(Database& database, std::int64_t version) {
  Statement select = database.prepare("SELECT * FROM total");
  if (!select.step()) throw damaged(database.name(), "the table 'total' is empty");
  Totals totals;
  RowReader row(select, database.name());
  visitTotals(row, version, totals);
  row.finish();
  if (select.step()) throw damaged(database.name(), "the table 'total' has two rows");
  return totals;
}

void checkText(const std::string& what, const std::string& text) {
  if (text.size() <= kLongestText && text.find('\0') == std::string::npos) return;
  throw std::invalid_argument(what + " of a map file is longer than 1 MB, or has a zero byte");
}

void checkInfo(const MapInfo& info) {
  if (!info.classes) throw std::invalid_argument("a map file needs a class table");
  if (!isGood(info.resolution)) throw std::invalid_argument("the resolution of a map file must be above 0");
  if (!isGood(info.prior)) throw std::invalid_argument("the prior of a map file must be above 0");
  if (info.unit_exponent != kUnitExponent) {
    throw std::invalid_argument("the unit exponent of a map file must be " + std::to_string(kUnitExponent) +
                                ", and is " + std::to_string(info.unit_exponent));
  }
  checkText("the frame", info.frame);
  checkText("the parameters", info.parameters);
  checkText("the name of the class table", info.classes->name());
  for (const SemanticClass& c : info.classes->classes()) checkText("the name of a class", c.name);
}

void checkDrive(const DriveRecord& drive) {
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
  checkText("the id of a drive", drive.id);
  checkText("the name of a drive", drive.name);
  if (drive.id.empty()) throw std::invalid_argument("the id of a drive is empty");
  if (drive.part < 0) throw std::invalid_argument("the part of drive '" + drive.id + "' is negative");
  if (drive.scans > kMost || drive.first_stamp > kMost || drive.last_stamp > kMost) {
    throw std::invalid_argument("a number of drive '" + drive.id + "' is 2^63 or more");
  }
  if (!drive.bounds.min().allFinite() || !drive.bounds.max().allFinite()) {
    throw std::invalid_argument("the bounds of drive '" + drive.id + "' are not finite");
  }
}

}  // namespace bki_mapping
