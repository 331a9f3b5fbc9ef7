// Converts a map file of an older version to the current one.
#include "store/migration.h"

#include <iostream>
#include <stdexcept>

#include "bki_mapping/store/mapper_file.h"
#include "store/schema.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;

int migrateFile(const tools::po::variables_map& given) {
  const auto files =
      given.count("files") ? given["files"].as<std::vector<std::string>>() : std::vector<std::string>();
  if (files.size() != 2) {
    throw std::invalid_argument("migrate_map needs two files, the old and the new one (see --help)");
  }
  if (!isMapFileName(files[1]))
    throw std::invalid_argument("the new file, " + files[1] + ", must end in .bkm");
  const std::int64_t version = migrateMap(files[0], files[1]);
  std::cout << files[1] << ": version " << kFormatVersion << ", from version " << version << " in "
            << files[0] << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "migrate_map",
                    "migrate_map OLD.bkm NEW.bkm\n"
                    "Converts a map file of any version to the current version, and checks it.",
                    tools::po::options_description("Options"), migrateFile, "files");
}
