/// @file Map files of older versions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "store/database.h"

namespace bki_mapping {

/// Changes a map file of one version into one of the next.
struct MigrationStep {
  std::int64_t from;  ///< version
  void (*run)(Database& database);
};

/// Takes a database from a version of the format to a later one, step by step.
/// @throws std::logic_error if a step is missing, and whatever a step throws.
void migrate(Database& database, std::int64_t version, std::int64_t to,
             const std::vector<MigrationStep>& steps);

/// Copies a map file of any version to a new file of kFormatVersion, and checks every byte of it. The old
/// file stays as it is. @return the version of the old file.
/// @throws MapFileError if the old file cannot be read, is damaged, or of a newer version, or if the new file
/// exists or cannot be written.
std::int64_t migrateMap(const std::string& old_path, const std::string& new_path);

}  // namespace bki_mapping
