#include "city/city_index.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "store/database.h"

namespace bki_mapping {
namespace {

using Json = nlohmann::json;

constexpr std::uintmax_t kMostBytes = 64'000'000;
constexpr std::size_t kMostValues = 2'000'000;
constexpr int kMostLevels = 16;
constexpr std::int64_t kMostRegionTiles = 1'000'000;  ///< as map_city
constexpr std::int64_t kMostTileIndex = (std::int64_t{1} << 22) + 1;
constexpr std::int64_t kMostCount = std::int64_t{1} << 53;

/// What is wrong with the content of an index. The text may quote it.
class Fault : public std::runtime_error {
 public:
  explicit Fault(std::string what) : std::runtime_error(withoutZeros(std::move(what))) {}

 private:
  static std::string withoutZeros(std::string text) {
    std::replace(text.begin(), text.end(), '\0', '?');
    return text;
  }
};

/// Refuses a text while it is parsed, before memory is taken for more of it.
class Bounds {
 public:
  bool operator()(int depth, Json::parse_event_t event, Json& parsed) {
    using Event = Json::parse_event_t;
    if (depth > kMostLevels)
      throw Fault("it is nested more than " + std::to_string(kMostLevels) + " levels deep");
    if (event == Event::object_start) keys_.emplace_back();
    if (event == Event::object_end) keys_.pop_back();
    if (event == Event::key && !keys_.back().insert(parsed.get<std::string>()).second) {
      throw Fault("'" + parsed.get<std::string>() + "' is given twice");
    }
    if (event != Event::object_end && event != Event::array_end && ++values_ > kMostValues) {
      throw Fault("it has more than " + std::to_string(kMostValues) + " values");
    }
    return true;
  }

 private:
  std::vector<std::set<std::string>> keys_;
  std::size_t values_ = 0;
};

/// A member of an object. @throws Fault if it is missing.
const Json& member(const Json& object, const char* name, const std::string& what) {
  if (!object.is_object()) throw Fault(what + " is no mapping");
  const auto found = object.find(name);
  if (found == object.end()) throw Fault(what + " has no '" + name + "'");
  return *found;
}

std::int64_t integer(const Json& object, const char* name, const std::string& what, std::int64_t least,
                     std::int64_t most) {
  const Json& value = member(object, name, what);
  const bool fits =
      value.is_number_integer() &&
      (!value.is_number_unsigned() || value.get<std::uint64_t>() <= static_cast<std::uint64_t>(kMostCount));
  const std::int64_t number = fits ? value.get<std::int64_t>() : 0;
  if (!fits || number < least || number > most) {
    throw Fault("'" + std::string(name) + "' of " + what + " is no whole number from " +
                std::to_string(least) + " to " + std::to_string(most));
  }
  return number;
}

std::string text(const Json& object, const char* name, const std::string& what) {
  const Json& value = member(object, name, what);
  if (!value.is_string()) throw Fault("'" + std::string(name) + "' of " + what + " is no text");
  return value.get<std::string>();
}

const Json& list(const Json& object, const char* name, const std::string& what) {
  const Json& value = member(object, name, what);
  if (!value.is_array()) throw Fault("'" + std::string(name) + "' of " + what + " is no list");
  return value;
}

/// A file of a region must lie in the folder of regions: an index from elsewhere cannot name others.
std::string regionFile(const Json& region, const std::string& what) {
  const std::string file = text(region, "file", what), folder = "regions/";
  const std::string name = file.substr(std::min(folder.size(), file.size()));
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return c != '/' && static_cast<unsigned char>(c) >= ' ' && c != '\x7f';
  });
  if (file.compare(0, folder.size(), folder) != 0 || !plain || name.empty() || name.front() == '.' ||
      std::filesystem::path(name).extension() != ".bkm") {
    throw Fault("the file of " + what + ", '" + file + "', is not regions/NAME.bkm");
  }
  return file;
}

Eigen::Vector3d corner(const Json& bounds, const char* name, const std::string& what) {
  const std::string owner = "the bounds of " + what;
  const Json& numbers = list(bounds, name, owner);
  Eigen::Vector3d corner;
  if (numbers.size() != 3) throw Fault("a corner of the bounds of " + what + " has not three numbers");
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (!numbers[axis].is_number())
      throw Fault("a corner of the bounds of " + what + " has not three numbers");
    corner[static_cast<Eigen::Index>(axis)] = numbers[axis].get<double>();
  }
  return corner;
}

CityRegion readRegion(const Json& region, const std::string& what, std::int64_t region_tiles) {
  const std::int64_t farthest = kMostTileIndex / region_tiles + 1;
  CityRegion read;
  read.x = static_cast<std::int32_t>(integer(region, "x", what, -farthest, farthest));
  read.y = static_cast<std::int32_t>(integer(region, "y", what, -farthest, farthest));
  read.file = regionFile(region, what);
  read.tiles = static_cast<std::uint64_t>(integer(region, "tiles", what, 0, kMostCount));
  read.blocks = static_cast<std::uint64_t>(integer(region, "blocks", what, 0, kMostCount));
  read.bytes = static_cast<std::uint64_t>(integer(region, "bytes", what, 0, kMostCount));
  const Json& bounds = member(region, "bounds", what);
  if (!bounds.is_null()) read.bounds = {corner(bounds, "min", what), corner(bounds, "max", what)};
  return read;
}

void readRegions(const Json& json, CityIndex& index) {
  const std::string owner = "the index";
  const Json& regions = list(json, "regions", owner);
  if (regions.empty()) throw Fault("it lists no regions");
  std::set<std::string> files;
  for (std::size_t n = 0; n < regions.size(); ++n) {
    const std::string what = "region " + std::to_string(n + 1);
    index.regions.push_back(readRegion(regions[n], what, index.region_tiles));
    if (!files.insert(index.regions.back().file).second) {
      throw Fault("two regions have the file '" + index.regions.back().file + "'");
    }
  }
  const auto place = [](const CityRegion& region) { return std::make_pair(region.x, region.y); };
  std::sort(index.regions.begin(), index.regions.end(),
            [&](const CityRegion& a, const CityRegion& b) { return place(a) < place(b); });
  const auto twice =
      std::adjacent_find(index.regions.begin(), index.regions.end(),
                         [&](const CityRegion& a, const CityRegion& b) { return place(a) == place(b); });
  if (twice != index.regions.end()) {
    throw Fault("two regions overlap at (" + std::to_string(twice->x) + ", " + std::to_string(twice->y) +
                ")");
  }
}

void readDrives(const Json& json, CityIndex& index) {
  const std::string owner = "the index";
  const Json& drives = list(json, "drives", owner);
  for (std::size_t n = 0; n < drives.size(); ++n) {
    const std::string what = "drive " + std::to_string(n + 1);
    index.drives.push_back(text(drives[n], "name", what));
    for (const Json& piece : list(drives[n], "pieces", what)) {
      const std::string id = text(piece, "id", "a piece of " + what);
      if (!index.pieces.insert(id).second) throw Fault("piece '" + id + "' is listed twice");
    }
  }
  std::sort(index.drives.begin(), index.drives.end());
}

std::string contentOf(const std::string& path) {
  std::error_code unknown;
  if (!std::filesystem::exists(path, unknown)) {
    const std::string folder = std::filesystem::path(path).parent_path().string();
    throw MapFileError(folder +
                       " holds no index.json, which map_city writes last; name the folder of a "
                       "finished city");
  }
  if (!std::filesystem::is_regular_file(path, unknown)) {
    throw MapFileError(path + " is not a regular file; name the folder of a city");
  }
  if (std::filesystem::file_size(path, unknown) > kMostBytes) throw Fault("it is larger than 64 MB");
  std::ifstream file(path, std::ios::binary);
  std::string content{std::istreambuf_iterator<char>(file), {}};
  if (!file && !file.eof()) throw MapFileError(path + " cannot be read; check name and rights");
  return content;
}

}  // namespace

CityIndex readCityIndex(const std::string& path) {
  try {
    const std::string content = contentOf(path);
    // Parse errors quote the text, which may hold anything, so only their place is kept.
    Json json;
    try {
      json = Json::parse(content, Bounds());
    } catch (const Json::parse_error& error) {
      throw Fault("it is no JSON at byte " + std::to_string(error.byte));
    }
    if (integer(json, "version", "the index", 0, kMostCount) != 1) {
      throw MapFileError(path +
                         " is of a newer version than this program, which reads version 1; use a newer "
                         "bki_mapping");
    }
    CityIndex index;
    index.region_tiles =
        static_cast<std::int32_t>(integer(json, "region_tiles", "the index", 1, kMostRegionTiles));
    if (json.contains("resolution")) {
      const Json& resolution = json["resolution"];
      if (!resolution.is_number() || !(resolution.get<double>() > 0.0)) {
        throw Fault("'resolution' of the index is no number above 0");
      }
      index.resolution = resolution.get<double>();
    }
    readRegions(json, index);
    readDrives(json, index);
    return index;
  } catch (const Fault& fault) {
    throw damaged(path, fault.what());
  } catch (const Json::exception&) {
    throw damaged(path, "a value cannot be read");
  }
}

}  // namespace bki_mapping
