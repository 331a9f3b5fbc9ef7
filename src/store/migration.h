/// @file Map files of older versions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "store/database.h"

namespace bki_mapping {

/// Converts a map file of one version to the next version.
struct MigrationStep {
  std::int64_t from;  ///< version
  void (*run)(Database& database);
};

/// Converts a database from one version of the format to a later one, step by step.
/// @throws std::logic_error if a step is missing, and whatever a step throws.
void migrate(Database& database, std::int64_t version, std::int64_t to,
             const std::vector<MigrationStep>& steps);

/// Copies a map file of any version to a new file of kFormatVersion, and checks every byte of the copy. The
/// old file stays as it is. @return the version of the old file.
/// @throws MapFileError if the old file cannot be read, is damaged or has a newer version, or if the new file
/// exists already or cannot be written.
std::int64_t migrateMap(const std::string& old_path, const std::string& new_path);

}  // namespace bki_mapping
