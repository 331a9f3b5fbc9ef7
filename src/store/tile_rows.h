/// @file The rows of a map file's table of tiles.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bki_mapping/store/map_file.h"
#include "store/box_tiles.h"
#include "store/database.h"
#include "store/records.h"

namespace bki_mapping {

/// Tiles farther out contain no voxel with a valid index, nor any neighbour of one.
constexpr int kMostTileIndex = (1 << 22) + 1;
static_assert(GridGeometry::kMaxCoordinate == double{1 << 22} * kTileEdge);

/// Adds all rows to `found`, which has no tiles yet, and checks their order, on which searches rely. Stops
/// one row after `expected`: then there are too many.
void readTileList(Database& database, std::int64_t expected, Totals& found);
/// The parts that have tiles, sorted.
std::vector<int> readTileParts(Database& database);
/// The tiles of a part from `low` to `high`, both included, sorted by z, y, x.
std::vector<TileEntry> readTileRange(Database& database, const GridIndex& low, const GridIndex& high,
                                     int part);
std::optional<TileEntry> readTileEntry(Database& database, const TileKey& key);

/// Called with a tile and its packed content, which is valid during the call only.
using TileVisit = std::function<void(const TileEntry&, const Statement::Bytes& content)>;
/// Reads a tile with its content. @return false if there is none.
bool readTile(Database& database, const TileKey& key, const TileVisit& visit);

/// Writes a tile that the table does not have, and adds it to the totals.
void insertTile(Database& database, const TileKey& key, const TileEntry& entry, const std::string& content,
                Totals& totals);
/// Erases a tile, if there is one, and takes it off the totals.
void eraseTile(Database& database, const TileKey& key, Totals& totals);

/// Names a tile in errors.
std::string nameOfTile(const TileKey& key);

}  // namespace bki_mapping
