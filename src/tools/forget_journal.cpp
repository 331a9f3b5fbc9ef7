// Drops the journal of a map file.
#include <filesystem>
#include <iostream>
#include <stdexcept>

#include "bki_mapping/store/mapper_file.h"
#include "core/counted.h"
#include "export/map_statistics.h"
#include "tools/map_copy.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("output", tools::textOption("FILE.bkm"),
                        "file for the result; default: the file itself is changed, and does not shrink");
  return options;
}

int forgetJournal(const po::variables_map& given) {
  const std::string path = tools::onlyMapFile(given);
  const std::string output = given.count("output") ? given["output"].as<std::string>() : path;
  if (!isMapFileName(output))
    throw std::invalid_argument("the map without a journal, " + output + ", must end in .bkm");
  std::error_code missing;
  const bool in_place = output == path || std::filesystem::equivalent(path, output, missing);
  MapFile file(path, in_place ? MapFile::Access::kUpdate : MapFile::Access::kRead);
  const JournalStatistics journal = readJournalStatistics(file);
  if (in_place) {
    MapFile::Change change = file.change();
    change.eraseJournal();
    change.commit();
  } else {
    NewMapFile copy(output, file.info());
    tools::copyParts(file, 0, copy.content());
    copy.commit();
  }
  std::cout << output << ": " << counted(journal.scans, "scan") << " of the journal forgotten, "
            << counted(journal.bytes, "byte") << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(
      argc, argv, "forget_journal",
      "forget_journal FILE.bkm\n"
      "Drops the scans that a map keeps in its journal. The map stays, and they cannot be moved "
      "any more.",
      options(), forgetJournal, "files");
}
