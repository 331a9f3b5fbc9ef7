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

using Export = void (*)(const std::string&, const SemanticMap&, const StateRules&, const ClassTable&,
                        const ExportOptions&);

void exportPoints(const std::string& path, const SemanticMap& map, const StateRules& rules,
                  const ClassTable& classes, const ExportOptions& options) {
  exportMap(path, map, rules, classes, options.states);
}
void exportTree(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes, const ExportOptions&) {
  exportOctoMap(path, map, rules, classes);
}
void exportColumns(const std::string& path, const SemanticMap& map, const StateRules& rules,
                   const ClassTable& classes, const ExportOptions& options) {
  exportGrid(path, map, rules, classes, options.columns);
}

void exportFaces(const std::string& path, const SemanticMap& map, const StateRules& rules,
                 const ClassTable& classes, const ExportOptions&) {
  exportMesh(path, map, rules, classes);
}

void exportPage(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes, const ExportOptions& options) {
  exportHtml(path, map, rules, classes, options.html);
}

Export exportOf(const std::string& path, bool mesh) {
  if (mesh) {
    checkMeshName(path);
    return exportFaces;
  }
  const std::string ending = std::filesystem::path(path).extension().string();
  if (ending == ".ply" || ending == ".pcd") return exportPoints;
  if (ending == ".ot" || ending == ".bt") return exportTree;
  if (ending == ".yaml") return exportColumns;
  if (ending == ".glb") return exportFaces;
  if (ending == ".html") return exportPage;
  throw std::invalid_argument("the exported file, " + path +
                              ", must end in .ply, .pcd, .ot, .bt, .yaml, .glb or .html");
}

}  // namespace

void checkExport(const std::string& path, const ExportOptions& options) {
  const Export chosen = exportOf(path, options.mesh);
  checkWritable(path);
  if (chosen == exportColumns) checkWritable(gridImagePath(path));
  if (chosen == exportPage) checkHtml(options.html);
}

void exportFile(const std::string& path, const SemanticMap& map, const StateRules& rules,
                const ClassTable& classes, const ExportOptions& options) {
  exportOf(path, options.mesh)(path, map, rules, classes, options);
}

HeightReference parseHeightReference(const std::string& word) {
  if (word == "map") return HeightReference::kMap;
  if (word == "ground") return HeightReference::kGround;
  throw std::invalid_argument("the zero of heights is '" + word + "', but must be map or ground");
}

}  // namespace bki_mapping
