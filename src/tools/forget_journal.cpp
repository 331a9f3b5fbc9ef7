// Drops the journal of a map file.
#include <iostream>

#include "core/counted.h"
#include "journal/corrected_file.h"
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
  const ForgottenScans forgotten = forgetJournalOfFile(path, output);
  std::cout << output << ": " << counted(forgotten.scans, "scan") << " of the journal forgotten, "
            << counted(forgotten.bytes, "byte") << "\n";
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
