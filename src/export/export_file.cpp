#include "export/export_file.h"

#include <filesystem>
#include <stdexcept>

#include "bki_mapping/export/map_export.h"
#include "core/atomic_file.h"
#include "export/grid_export.h"
#include "export/mesh_export.h"
#include "export/octomap_export.h"

namespace bki_mapping {
namespace {

enum class Format { kPoints, kTree, kColumns, kFaces, kPage };

Format formatOf(const std::string& path, bool mesh) {
  if (mesh) {
    checkMeshName(path);
    return Format::kFaces;
  }
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".ply" || ending == ".pcd") return Format::kPoints;
  if (ending == ".ot" || ending == ".bt") return Format::kTree;
  if (ending == ".yaml") return Format::kColumns;
  if (ending == ".glb") return Format::kFaces;
  if (ending == ".html") return Format::kPage;
  throw std::invalid_argument("the exported file, " + path +
                              ", must end in .ply, .pcd, .ot, .bt, .yaml, .glb or .html");
}

}  // namespace

void checkExport(const std::string& path, const ExportOptions& options) {
  const Format format = formatOf(path, options.mesh);
  checkWritable(path);
  if (format == Format::kColumns) checkWritable(gridImagePath(path));
  if (format == Format::kPage) checkHtml(options.html);
}

void exportFile(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes, const ExportOptions& options) {
  switch (formatOf(path, options.mesh)) {
    case Format::kPoints:
      return exportMap(path, map, rules, classes, options.states);
    case Format::kTree:
      return exportOctoMap(path, map, rules, classes);
    case Format::kColumns:
      return exportGrid(path, map, rules, classes, options.columns);
    case Format::kFaces:
      return exportMesh(path, map, rules, classes);
    case Format::kPage:
      return exportHtml(path, map, rules, classes, options.html);
  }
}

HeightReference parseHeightReference(const std::string& word) {
  if (word == "map") return HeightReference::kMap;
  if (word == "ground") return HeightReference::kGround;
  throw std::invalid_argument("the zero of heights is '" + word + "', but must be map or ground");
}

}  // namespace bki_mapping
