// Exports a map file for other programs.
#include <iostream>
#include <stdexcept>

#include "bki_mapping/io/map_export.h"
#include "bki_mapping/io/mapper_file.h"
#include "io/export_file.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  const auto text = [](const char* name) { return po::value<std::string>()->value_name(name); };
  const ColumnRules rules;
  options.add_options()(
      "output", text("FILE"),
      "file to write; its extension chooses the format: .ply or .pcd, voxels as points; .ot, OctoMap with "
      "the colours of classes; .bt, OctoMap of occupied and free; .yaml, with an image .pgm beside it, "
      "for map_server")("include", text("STATES")->default_value("occupied"),
                        "voxels in a .ply or .pcd file: occupied,free,occluded")(
      "min-z", po::value<double>()->value_name("M")->default_value(rules.min_z),
      "lowest height of obstacles in a .yaml map")(
      "max-z", po::value<double>()->value_name("M")->default_value(rules.max_z),
      "greatest height of obstacles in a .yaml map")(
      "height", text("map|ground")->default_value("map"),
      "zero of these heights: the origin of the map frame, or the ground below");
  return options;
}

ColumnRules columnRules(const po::variables_map& given) {
  ColumnRules rules;
  rules.min_z = given["min-z"].as<double>();
  rules.max_z = given["max-z"].as<double>();
  if (!(rules.min_z <= rules.max_z)) throw std::invalid_argument("--min-z must not be above --max-z");
  rules.reference = parseHeightReference(given["height"].as<std::string>());
  return rules;
}

int exportMapFile(const po::variables_map& given) {
  const std::string path = tools::onlyMapFile(given);
  if (!given.count("output")) throw std::invalid_argument("--output FILE is missing (see --help)");
  const std::string output = given["output"].as<std::string>();
  const ExportOptions options{parseStates(given["include"].as<std::string>()), columnRules(given)};
  checkExport(output);

  const StoredMap stored = loadMapWithGains(path);
  exportFile(output, stored.map, *stored.info.classes, options);
  std::cout << output << ": written, in frame " << stored.info.frame << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run("export_map", [&] {
    const auto given = tools::parse(argc, argv,
                                    "export_map FILE.bkm --output FILE\n"
                                    "Converts a map for other programs.",
                                    options(), "files");
    return given ? exportMapFile(*given) : 0;
  });
}
