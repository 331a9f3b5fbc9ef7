/// @file The tables of a map file, the version of its format, and the program that writes it.
#pragma once

#include <cstdint>

#include "store/database.h"

namespace bki_mapping {

/// "BKIM", the application_id in the header of the file.
constexpr std::int64_t kApplicationId = 0x424b494d;
constexpr std::int64_t kFormatVersion = 6;
/// Before it, tiles have no looks (bki_mapping/map/looks.h).
constexpr std::int64_t kFirstVersionWithLooks = 3;
/// Before it, tiles hold looks with two bits for each voxel.
constexpr std::int64_t kFirstVersionWithLookRows = 5;
/// Before it, tiles hold the four bytes of evidence, and no multiples (src/store/evidence_steps.h).
constexpr std::int64_t kFirstVersionWithSteps = 6;
/// Before it, files have no journal (bki_mapping/store/scan_record.h).
constexpr std::int64_t kFirstVersionWithJournal = 4;

/// What writes map files, with its version as in package.xml: "bki_mapping 0.2.0".
const char* programName();

/// Marks an empty database as a map file, and creates the tables.
void createSchema(Database& database);

/// Checks that a file is a map, before SQLite interprets any of it. @return the version of its format.
/// @throws MapFileError if it is not a map, or has a newer version.
std::int64_t checkIdentity(const Database& database);
/// Checks that a file has not been cut off at its end.
void checkComplete(const Database& database);
/// Checks that the file has the tables of a version, and no others.
void checkSchema(const Database& database, std::int64_t version);
/// Makes the tables of a version of those of the version before. Tables whose columns differ are then empty.
void changeSchema(Database& database, std::int64_t version);

}  // namespace bki_mapping
