// Maps a sequence with labels of moving things, and measures what the map kept and what it forgot.
#include <iomanip>
#include <iostream>

#include "bki_mapping/io/atomic_file.h"
#include "bki_mapping/io/report.h"
#include "bki_mapping/io/sequence.h"
#include "bki_mapping/mapping/dynamics_quality.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/mapping/semantic_quality.h"
#include "bki_mapping/tools/options.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  options.add_options()("json", po::value<std::string>()->value_name("FILE.json"), "figures to write")(
      "late", po::value<std::size_t>()->value_name("N")->default_value(3),
      "voxels hit in the last N scans need not be cleared")(
      "label-noise", po::value<double>()->value_name("SHARE")->default_value(0.0),
      "give the mapper this share of labels wrong")(
      "noise-seed", po::value<std::uint64_t>()->value_name("N")->default_value(1),
      "same seed, same wrong labels");
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
  SemanticEvaluation semantics(mapper.map().geometry());
  const double noise = given["label-noise"].as<double>();
  if (!(noise >= 0.0 && noise <= 1.0)) throw std::invalid_argument("--label-noise must be a share, 0 to 1");
  std::vector<double> times;
  for (std::size_t i = first; i < last; ++i) {
    const Scan scan = sequence.read(i).scan();
    Scan told = scan;
    if (noise > 0.0) {
      told.labels = withLabelNoise(scan, mapper.classes(), noise, given["noise-seed"].as<std::uint64_t>());
    }
    times.push_back(mapper.integrate(told).totalMs());
    evaluation.add(scan, mapper.classes());
    semantics.add(scan, told.labels, mapper.classes());
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
  print("HA", quality.harmonicAccuracy(), "2 SA DA / (SA + DA)");
  const SemanticQuality semantic = semantics.compare(mapper.map());
  print("mIoU of the map", semantic.map.meanIou(), "at the labelled points");
  print("mIoU of the input", semantic.input.meanIou(), "of the labels given to the mapper");
  print("ECE", semantic.calibrationError(), "expected calibration error of the class's probability");
  print("AUSE", semantic.sparsificationError, "area under the sparsification error curve, by variance");
  std::cout << quality.static_points << " points of standing and " << quality.moving_points
            << " of moving things; median " << median_ms << " ms a scan\n";
  if (quality.moving_points == 0) {
    std::cout << "there is no point of a moving thing (raw labels 252 to 259), so DA and AA are not known\n";
  }
  if (given.count("json")) {
    writeTextFile(given["json"].as<std::string>(),
                  qualityJson(quality, semantic, mapper.classes(), median_ms));
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
