// Clears a box of a map file.
#include <iostream>
#include <stdexcept>

#include "bki_mapping/store/map_file.h"
#include "bki_mapping/store/mapper_file.h"
#include "core/counted.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("box", tools::textOption("\"X0 Y0 Z0 X1 Y1 Z1\""),
                        "two opposite corners of the box, in the map frame [m]; inf and -inf are allowed")(
      "output", tools::textOption("FILE.bkm"), "file for the result; default: the file itself is changed");
  return options;
}

int clearFile(const po::variables_map& given) {
  const std::string path = tools::onlyMapFile(given);
  if (!given.count("box")) throw std::invalid_argument("--box \"X0 Y0 Z0 X1 Y1 Z1\" is missing (see --help)");
  const std::string output = given.count("output") ? given["output"].as<std::string>() : path;
  if (!isMapFileName(output))
    throw std::invalid_argument("the cleared map, " + output + ", must end in .bkm");
  const ClearedFile cleared = clearBoxOfFile(path, tools::parseBox(given["box"].as<std::string>()), output);
  std::cout << output << ": cleared in " << counted(cleared.blocks, "block") << " of "
            << counted(cleared.tiles, "tile") << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "clear_map",
                    "clear_map FILE.bkm --box \"X0 Y0 Z0 X1 Y1 Z1\"\n"
                    "Clears a box of a map: its voxels become unknown.",
                    options(), clearFile, "files");
}
