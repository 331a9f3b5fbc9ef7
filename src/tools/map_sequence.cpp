// Maps a sequence in SemanticKITTI's layout without ROS, and writes a map file and a report.
#include <algorithm>
#include <iomanip>
#include <iostream>
#include <sstream>

#include "bki_mapping/io/config_yaml.h"
#include "bki_mapping/io/map_export.h"
#include "bki_mapping/io/sequence.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "core/atomic_file.h"
#include "evaluation/run_report.h"
#include "tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  const auto text = [](const char* name) { return po::value<std::string>()->value_name(name); };
  options.add_options()("output", text("FILE.ply|FILE.pcd"), "map file")(
      "include", text("STATES")->default_value("occupied"), "voxels in the map file: occupied,free,occluded")(
      "report", text("FILE.json"), "report of the run")("print-config", po::bool_switch(),
                                                        "print the effective parameters as YAML, and exit");
  options.add(tools::sequenceOptions()).add(tools::mapperOptions());
  return options;
}

std::string progressText(const ScanReport& scan) {
  std::ostringstream text;
  text << std::fixed << std::setprecision(1) << scan.stats.totalMs() << " ms";
  return text.str();
}

int mapSequence(const po::variables_map& given) {
  if (given["print-config"].as<bool>()) {
    std::cout << parameterYaml(tools::mapperConfig(given));
    return 0;
  }
  const auto states = parseStates(given["include"].as<std::string>());
  if (given.count("output")) checkMapFileName(given["output"].as<std::string>());
  for (const char* file : {"output", "report"}) {
    if (given.count(file)) checkWritable(given[file].as<std::string>());
  }
  SemanticMapper mapper(tools::mapperConfig(given), tools::classTable(given));
  const Sequence sequence = tools::openSequence(given);
  const auto [first, last] = tools::frameRange(given, sequence);

  std::vector<ScanReport> scans;
  std::size_t refused = 0;
  for (std::size_t i = first; i < last; ++i) {
    try {
      scans.push_back({sequence.name(i), mapper.integrate(sequence.read(i).scan())});
    } catch (const ScanRefused& refusal) {
      // Report the first refusal and count the others, which mostly have the same reason.
      if (refused++ == 0)
        std::cerr << "map_sequence: scan " << sequence.name(i) << ": " << refusal.what() << "\n";
      continue;
    }
    tools::showProgress(scans.size(), last - first, progressText(scans.back()));
  }
  if (given.count("output"))
    exportMap(given["output"].as<std::string>(), mapper.map(), mapper.classes(), states);
  if (given.count("report")) writeTextFile(given["report"].as<std::string>(), reportJson(mapper, scans));
  std::cout << summaryText(mapper, scans);
  if (refused > 0) {
    std::cerr << "map_sequence: " << refused << " of " << last - first << " scans were refused\n";
  }
  return refused > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run("map_sequence", [&] {
    const auto given = tools::parse(argc, argv, "Maps a sequence in SemanticKITTI's layout.", options());
    return given ? mapSequence(*given) : 0;
  });
}
