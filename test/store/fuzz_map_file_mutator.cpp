// Mutates map files for libFuzzer: bytes that SQLite does not accept teach little, so most mutants are
// changed through SQLite, with checksums made right.
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <random>
#include <string>

#include "store/file_content.h"
#include "store/forgery.h"
#include "store/map_maker.h"
#include "temporary_folder.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace bki_mapping {
namespace {

using Random = std::minstd_rand;

template <typename T, std::size_t n>
const T& oneOf(const std::array<T, n>& values, Random& random) {
  return values[random() % n];
}

std::string randomValue(Random& random) {
  static const std::array<std::string, 22> kValues{"0",
                                                   "1",
                                                   "-1",
                                                   "2",
                                                   "255",
                                                   "256",
                                                   "512",
                                                   "513",
                                                   "130560",
                                                   "2147483647",
                                                   "-2147483648",
                                                   "4294967296",
                                                   "9223372036854775807",
                                                   "0.5",
                                                   "-1e300",
                                                   "9e999",
                                                   "NULL",
                                                   "''",
                                                   "'a b'",
                                                   "x''",
                                                   "char(0)",
                                                   "zeroblob(1000)"};
  return oneOf(kValues, random);
}

std::string randomChange(Random& random) {
  static const std::array<std::string, 9> kTables{"map",  "class",    "drive",   "tile",        "total",
                                                  "scan", "settings", "cleared", "scan_content"};
  static const std::array<std::string, 43> kColumns{
      "resolution",      "unit_exponent", "prior",  "frame",     "class_table", "label_mask", "parameters",
      "program",         "position",      "id",     "name",      "red",         "raw",        "any_raw",
      "unlabelled",      "dynamic",       "ground", "free_gain", "part",        "scans",      "first_stamp",
      "min_x",           "max_z",         "z",      "y",         "x",           "blocks",     "planes",
      "checksum",        "content",       "tiles",  "checksums", "drives",      "classes",    "ignored",
      "number",          "stamp",         "jump",   "reach",     "pose",        "odometry",   "bytes",
      "content_checksum"};
  const std::string& table = oneOf(kTables, random);
  const std::string row =
      " WHERE rowid = (SELECT rowid FROM " + table + " LIMIT 1 OFFSET " + std::to_string(random() % 4) + ")";
  const std::string column = oneOf(kColumns, random);
  switch (random() % 8) {
    case 0:
      return "DELETE FROM " + table + row;
    case 1:
      return "INSERT INTO " + table + " SELECT * FROM " + table + row;
    case 2:
      return "UPDATE " + table + " SET " + column + " = " + column + " + 1" + row;
    case 3:
      return "UPDATE tile SET content = CAST(substr(content, 1, " + std::to_string(random() % 200) +
             ") || x'" + (random() % 2 ? "00" : "ff") + "' || substr(content, " +
             std::to_string(random() % 200) + ") AS BLOB)";
    default:
      return "UPDATE " + table + " SET " + column + " = " + randomValue(random) + row;
  }
}

}  // namespace
}  // namespace bki_mapping

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size,
                                               unsigned seed) {
  using namespace bki_mapping;
  Random random(seed + 1);
  static const TemporaryFolder folder(memoryFolder());
  const std::string path = folder / "mutant.bkm";
  writeFile(path, {reinterpret_cast<const char*>(data), size});
  if (random() % 3 == 0 || sentenceOf([&] { MapFile(path, MapFile::Access::kRead); }) != "") {
    return LLVMFuzzerMutate(data, size, max_size);
  }
  try {
    Forgery forgery(path);
    // Few columns are in any one table.
    for (std::size_t left = 1 + random() % 3, trials = 0; left > 0 && trials < 40; ++trials)
      left -= forgery.run(randomChange(random));
    if (random() % 8 != 0) forgery.sign();
  } catch (const std::runtime_error&) {
  }
  const std::string bytes = readFile(path);
  if (bytes.size() > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::memcpy(data, bytes.data(), bytes.size());
  return bytes.size();
}
