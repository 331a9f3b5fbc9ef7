// Maps a sequence with labels of moving things, and measures what the map kept and what it forgot.
#include <iomanip>
#include <iostream>

#include "bki_mapping/io/atomic_file.h"
#include "bki_mapping/io/report.h"
#include "bki_mapping/io/sequence.h"
#include "bki_mapping/mapping/dynamics_quality.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("json", po::value<std::string>()->value_name("FILE.json"), "figures to write")(
      "late", po::value<std::size_t>()->value_name("N")->default_value(3),
      "voxels hit in the last N scans need not be cleared");
  options.add(tools::sequenceOptions()).add(tools::mapperOptions());
  return options;
}

void print(const char* name, double share, const char* meaning) {
  std::cout << name << std::setw(7) << std::fixed << std::setprecision(1) << 100.0 * share << " %  "
            << meaning << "\n";
}

int evaluate(const po::variables_map& given) {
  SemanticMapper mapper(tools::mapperConfig(given), tools::classTable(given));
  const Sequence sequence = tools::openSequence(given);
  const auto [first, last] = tools::frameRange(given, sequence);
  DynamicsEvaluation evaluation(mapper.map().geometry(), DynamicsEvaluation::movingOfSemanticKitti(),
                                last - first, given["late"].as<std::size_t>());
  std::vector<double> times;
  for (std::size_t i = first; i < last; ++i) {
    const Scan scan = sequence.read(i).scan();
    times.push_back(mapper.integrate(scan).totalMs());
    evaluation.add(scan, mapper.classes());
    tools::showProgress(times.size(), last - first, "");
  }
  const DynamicsQuality quality = evaluation.compare(mapper.map());
  const double median_ms = quantile(times, 0.5);
  print("SA", quality.staticAccuracy(), "of the points of standing things are in occupied voxels");
  print("  ground  ", quality.groundAccuracy(), "of those of ground");
  print("  standing", quality.standingAccuracy(), "of those of things that could move, but stand");
  print("  other   ", quality.otherAccuracy(), "of the others");
  print("holes", quality.holes(), "of the voxels that hold points of ground are not occupied");
  print("DA", quality.dynamicAccuracy(), "of the early points of moving things are not");
  print("AA", quality.accuracy(), "sqrt(SA DA)");
  std::cout << quality.static_points << " points of standing and " << quality.moving_points
            << " of moving things; median " << median_ms << " ms a scan\n";
  if (quality.moving_points == 0) {
    std::cout << "there is no point of a moving thing (raw labels 252 to 259), so DA and AA are not known\n";
  }
  if (given.count("json")) {
    writeTextFile(given["json"].as<std::string>(), qualityJson(quality, median_ms));
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run("evaluate_map", [&] {
    const auto given = tools::parse(
        argc, argv, "Measures what a map keeps of standing things and forgets of moving ones.", options());
    return given ? evaluate(*given) : 0;
  });
}
