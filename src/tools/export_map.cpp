// Exports a map file for other programs.
#include <filesystem>
#include <iostream>
#include <limits>
#include <stdexcept>

#include "bki_mapping/city/tiled_map.h"
#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/export/map_export.h"
#include "core/counted.h"
#include "export/export_file.h"
#include "sequence/trajectory_file.h"
#include "tools/options.h"
#include "tools/scan_points.h"

namespace {

using namespace bki_mapping;
namespace po = tools::po;

po::options_description options() {
  po::options_description options("Options");
  const ColumnRules rules;
  options.add_options()(
      "output", tools::textOption("FILE"),
      "file to write; its extension chooses the format: .ply or .pcd, voxels as points; .ot, OctoMap with "
      "the colours of classes; .bt, OctoMap of occupied and free; .yaml, with an image .pgm beside it, "
      "for map_server; .glb, a mesh for Blender; .html, a page for browsers (needs libjs-three)")(
      "html", tools::textOption("FILE.html"), "the same as --output FILE.html")(
      "mesh", po::bool_switch(), "write the faces of occupied voxels to a .ply file, not points")(
      "include", tools::textOption("STATES"),
      "voxels in a .ply, .pcd or .html file: occupied,free,occluded; default: occupied, in a .html file all")(
      "box", tools::textOption("\"X0 Y0 Z0 X1 Y1 Z1\""),
      "export only what lies in a box: two opposite corners, in the map frame [m]; inf and -inf are allowed")(
      "points", tools::textOption("FILE"),
      "write the points of the scans in the journal of a map file, where they are in the map, to a .ply or "
      ".pcd file, instead of the map")(
      "trajectory", po::value<std::vector<std::string>>()->value_name("PATH")->composing(),
      "draw where the sensor was in a .html file: the folder of a sequence, or a file with lines "
      "`stamp x y z qx qy qz qw`, in the map frame; repeatable")(
      "three-js", tools::textOption("FILE"), "three.js for a .html file, if it is not that of libjs-three")(
      "min-z", po::value<double>()->value_name("M")->default_value(rules.min_z),
      "lowest height of obstacles in a .yaml map")(
      "max-z", po::value<double>()->value_name("M")->default_value(rules.max_z),
      "greatest height of obstacles in a .yaml map")(
      "height", tools::textOption("map|ground")->default_value("map"),
      "zero of these heights: the origin of the map frame, or the ground below");
  tools::addMemoryLimit(options);
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

std::string outputOf(const po::variables_map& given) {
  if (!given.count("html")) {
    if (!given.count("output")) throw std::invalid_argument("--output FILE is missing (see --help)");
    return given["output"].as<std::string>();
  }
  const std::string page = given["html"].as<std::string>();
  if (given.count("output")) throw std::invalid_argument("--html and --output name one file each; keep one");
  if (std::filesystem::path(page).extension() != ".html")
    throw std::invalid_argument("--html: the page, " + page + ", must end in .html");
  return page;
}

ExportOptions exportOptions(const po::variables_map& given) {
  ExportOptions options;
  options.columns = columnRules(given);
  options.mesh = given["mesh"].as<bool>();
  if (given.count("include")) {
    options.states = options.html.states = parseStates(given["include"].as<std::string>());
  }
  if (given.count("three-js")) options.html.three_js = given["three-js"].as<std::string>();
  if (given.count("trajectory")) {
    for (const std::string& path : given["trajectory"].as<std::vector<std::string>>()) {
      options.html.trajectories.push_back(readTrajectory(path));
    }
  }
  return options;
}

Eigen::AlignedBox3d boxOf(const po::variables_map& given) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (given.count("box")) return tools::parseBox(given["box"].as<std::string>());
  return {Eigen::Vector3d::Constant(-kInfinity), Eigen::Vector3d::Constant(kInfinity)};
}

/// Writes the points of scans in place of the map.
int exportPoints(const po::variables_map& given) {
  const std::string path = tools::onlyMapFile(given), points = given["points"].as<std::string>();
  for (const auto& [name, value] : given) {
    if (value.defaulted() || name == "files" || name == "points" || name == "box") continue;
    throw std::invalid_argument("--" + name + " cannot be given with --points, which exports no map");
  }
  MapFile file(path, MapFile::Access::kRead);
  const tools::ScanPointCount count = tools::writeScanPoints(
      points, file, boxOf(given),
      [](std::size_t done, std::size_t all) { tools::showProgress(done, all, "scans"); });
  std::cout << points << ": " << counted(count.points, "point") << " of " << counted(count.scans, "scan")
            << ", in frame " << file.info().frame << "\n";
  return 0;
}

/// Where the origin of a file's coordinates is, as a clause; "" if it is that of the map frame.
std::string originText(const std::string& output, const SemanticMap& map) {
  if (std::filesystem::path(output).extension() != ".pcd") return "";
  const Eigen::Vector3d origin = pcdOrigin(map);
  if (origin.isZero(0.0)) return "";
  return ", relative to its VIEWPOINT at " + numberText(origin.x()) + ", " + numberText(origin.y()) + ", " +
         numberText(origin.z()) + " m";
}

int exportMapFile(const po::variables_map& given) {
  if (given.count("points")) return exportPoints(given);
  const std::string path = tools::onlyMapFile(given), output = outputOf(given);
  const Eigen::AlignedBox3d box = boxOf(given);
  ExportOptions options = exportOptions(given);
  checkExport(output, options);

  TiledMap map(path);
  const RuledMap stored = map.readBox(box, tools::memoryLimit(given));
  options.html.name = std::filesystem::path(map.path()).stem().string();
  options.html.frame = stored.info.frame;
  options.html.drives = stored.drives;
  options.html.parts = map.file();
  exportFile(output, stored.map, stored.rules, *stored.info.classes, options);
  std::cout << output << ": written, in frame " << stored.info.frame << originText(output, stored.map)
            << "\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return tools::run(argc, argv, "export_map",
                    "export_map MAP --output FILE\n"
                    "Converts a map, or a part of one, for other programs. MAP is a map file "
                    "(.bkm) or the folder of a city.",
                    options(), exportMapFile, "files");
}
