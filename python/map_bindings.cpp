#include <pybind11/stl.h>

#include <cmath>
#include <cstddef>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/export/map_export.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/store/mapper_file.h"
#include "export/export_file.h"

namespace bki_mapping::python {
namespace {

/// A block of a map, which it keeps alive.
struct MapBlock {
  SharedMap map;
  BlockIndex index;
  const Block* block;
};

py::array voxels(const FixedMap& map, py::handle states) {
  const VoxelStates wanted = parseStates(wordsOf(states, "states"));
  std::vector<VoxelRecord> records;
  {
    const py::gil_scoped_release release;
    records = collectVoxels(map.stored.map, map.stored.rules, *map.stored.info.classes, wanted);
  }
  using V = VoxelRecord;
  return ownedArray(std::move(records),
                    structType({{"x", "f8", offsetof(V, x)},
                                {"y", "f8", offsetof(V, y)},
                                {"z", "f8", offsetof(V, z)},
                                {"red", "u1", offsetof(V, red)},
                                {"green", "u1", offsetof(V, green)},
                                {"blue", "u1", offsetof(V, blue)},
                                {"label", "u2", offsetof(V, label)},
                                {"state", "u1", offsetof(V, state)},
                                {"probability", "f4", offsetof(V, probability)},
                                {"occupancy", "f4", offsetof(V, occupancy)},
                                {"class_probability", "f4", offsetof(V, class_probability)},
                                {"variance", "f4", offsetof(V, variance)},
                                {"entropy", "f4", offsetof(V, entropy)},
                                {"evidence", "f4", offsetof(V, evidence)}},
                               sizeof(V)));
}

void exportTo(const FixedMap& map, py::handle path, py::handle states, py::handle min_z, py::handle max_z,
              py::handle height) {
  ExportOptions options;
  if (!states.is_none()) options.states = options.html.states = parseStates(wordsOf(states, "states"));
  options.html.frame = map.stored.info.frame;
  options.html.drives = map.stored.drives;
  options.columns.min_z = numberOf(min_z, "min_z");
  options.columns.max_z = numberOf(max_z, "max_z");
  options.columns.reference = parseHeightReference(textOf(height, "height"));
  if (!(options.columns.min_z <= options.columns.max_z))
    throw std::invalid_argument("min_z must not be above max_z");
  const std::string file = pathOf(path, "path");
  options.html.name = std::filesystem::path(file).stem().string();
  const py::gil_scoped_release release;
  checkExport(file, options);
  exportFile(file, map.stored.map, map.stored.rules, *map.stored.info.classes, options);
}

void save(const FixedMap& map, py::handle path) {
  const std::string file = pathOf(path, "path");
  if (!isMapFileName(file)) throw std::invalid_argument("the map file, " + file + ", must end in .bkm");
  const py::gil_scoped_release release;
  saveMap(file, map.stored.info, map.stored.drives, map.stored.map);
}

std::string mapDescription(const FixedMap& map) {
  return "<bki_mapping.Map: " + std::to_string(map.stored.map.size()) + " blocks of 8 x 8 x 8 voxels of " +
         numberText(map.stored.info.resolution) + " m, frame '" + map.stored.info.frame + "', classes '" +
         map.stored.info.classes->name() + "'>";
}

/// A read-only view of planes: the array's base is the block, which keeps the map alive.
py::array planesOf(const py::object& self) {
  const auto& block = py::cast<const MapBlock&>(self);
  const auto count = static_cast<py::ssize_t>(block.block->classes().size());
  const EvidenceUnits* const data = count > 0 ? block.block->plane(0) : nullptr;
  return viewOf(self, data, {count, kBlockEdge, kBlockEdge, kBlockEdge});
}

py::array planeOf(const py::object& self, py::handle of_class) {
  const auto& block = py::cast<const MapBlock&>(self);
  const bool is_free = PyIndex_Check(of_class.ptr()) != 0 && py::int_(int{kFreeClass}).equal(of_class);
  const std::vector<ClassId> ids = is_free ? std::vector<ClassId>{kFreeClass}
                                           : orderOf(block.map->stored.info.classes, of_class, "class_");
  if (ids.size() != 1) throw std::invalid_argument("class_ must be one class");
  const ClassId id = ids.front();
  const ClassList& classes = block.block->classes();
  const std::size_t position = classes.positionOf(id);
  if (!classes.has(id, position)) {
    throw std::invalid_argument("the block has no plane of class " + std::to_string(id) +
                                "; see Block.classes for those that it has");
  }
  return planesOf(self)[py::int_(position)];
}

void addBlock(py::module& m) {
  py::class_<MapBlock>(m, "Block", "The evidence of 8 x 8 x 8 voxels. Keeps its map alive.")
      .def_property_readonly(
          "index", [](const MapBlock& b) { return py::make_tuple(b.index.x, b.index.y, b.index.z); },
          "The block's index in the grid of blocks.")
      .def_property_readonly(
          "origin",
          [](const MapBlock& b) {
            const Eigen::Vector3d origin = b.map->stored.map.geometry().blockOrigin(b.index);
            return py::array_t<double>(3, origin.data());
          },
          "The corner of the block with the smallest coordinates, map frame [m].")
      .def_property_readonly(
          "classes",
          [](const MapBlock& b) {
            const ClassList& classes = b.block->classes();
            return py::array_t<ClassId>(static_cast<py::ssize_t>(classes.size()), classes.begin());
          },
          "The ids of the classes of which a voxel has evidence, rising; FREE_CLASS for free space.")
      .def_property_readonly(
          "planes", &planesOf,
          "The evidence of each class of `classes` at each voxel: (classes, 8, 8, 8), int32, by class, z, y, "
          "x, in units of EVIDENCE_UNIT. A read-only view; nothing is copied.")
      .def("plane", &planeOf, py::arg("class_"),
           "The plane of a class, or of FREE_CLASS: (8, 8, 8), int32, by z, y, x. A read-only "
           "view.\n\nclass_: a name, "
           "an id or a SemanticClass.\n\nRaises ValueError if the block has no such plane.")
      .def("__repr__", [](const MapBlock& b) {
        return "<bki_mapping.Block (" + std::to_string(b.index.x) + ", " + std::to_string(b.index.y) + ", " +
               std::to_string(b.index.z) + ")>";
      });
}

void addDrive(py::module& m) {
  py::class_<DriveRecord>(m, "Drive", "A drive whose scans are in a map.")
      .def_readonly("id", &DriveRecord::id, "Unique to the drive; merging counts each id once.")
      .def_readonly("name", &DriveRecord::name, "For humans.")
      .def_readonly("scans", &DriveRecord::scans, "Number of scans.")
      .def_readonly("first_stamp", &DriveRecord::first_stamp, "Time of the earliest scan [ns].")
      .def_readonly("last_stamp", &DriveRecord::last_stamp, "Time of the latest scan [ns].")
      .def("__repr__", [](const DriveRecord& d) {
        return "<bki_mapping.Drive '" + d.id + "' of " + std::to_string(d.scans) + " scans>";
      });
}

py::object blockAt(const SharedMap& map, py::handle at) {
  const BlockIndex index{indexOf(at, "index")};
  const Block* const block = map->stored.map.find(index);
  return block ? py::cast(MapBlock{map, index, block}) : py::none();
}

py::array_t<std::int32_t> blockIndices(const FixedMap& map) {
  std::vector<GridIndex> indices;
  for (const auto& [index, block] : sortedBlocks(map.stored.map)) indices.push_back(index);
  return indexArray(indices);
}

/// The box of all blocks: its corners [m].
py::object mapBoundsOf(const FixedMap& map) {
  Eigen::AlignedBox3d box;
  {
    const py::gil_scoped_release release;
    const GridGeometry& grid = map.stored.map.geometry();
    for (const auto& entry : map.stored.map.entries()) {
      box.extend(grid.blockOrigin(entry.index));
      box.extend(grid.blockOrigin({{entry.index.x + 1, entry.index.y + 1, entry.index.z + 1}}));
    }
  }
  return cornersOf(box);
}

}  // namespace

const FixedMap& mapOf(py::handle object, const char* name) {
  if (py::isinstance<FixedMap>(object)) return py::cast<const FixedMap&>(object);
  throw py::type_error(std::string(name) + " must be a bki_mapping.Map, not " + typeName(object));
}

void addMap(py::module& m) {
  addBlock(m);
  addDrive(m);
  MapClass map(
      m, "Map",
      "A map that does not change: a snapshot of a mapper's, or one from a file. Queries take points in the "
      "map frame [m], as an array of shape (N, 3), float32 or float64 without a copy, and release the GIL. "
      "Points where nothing was mapped are unknown. They raise ValueError for a point that is not finite.");
  map.def_property_readonly(
         "resolution", [](const FixedMap& f) { return f.stored.info.resolution; }, "Edge of a voxel [m].")
      .def_property_readonly(
          "prior", [](const FixedMap& f) { return f.stored.info.prior; },
          "Concentration of each class, and of free, before any scan.")
      .def_property_readonly(
          "frame", [](const FixedMap& f) { return f.stored.info.frame; }, "Name of the map frame.")
      .def_property_readonly(
          "parameters", [](const FixedMap& f) { return f.stored.info.parameters; },
          "The settings of the mapper that made the map, as YAML.")
      .def_property_readonly(
          "classes",
          [](const FixedMap& f) { return std::const_pointer_cast<ClassTable>(f.stored.info.classes); },
          "The class table.")
      .def_property_readonly(
          "drives", [](const FixedMap& f) { return f.stored.drives; },
          "The drives whose scans are in the map.")
      .def_property_readonly(
          "bytes", [](const FixedMap& f) { return f.stored.map.bytes(); },
          "Memory of the map [bytes], including what it shares with snapshots.")
      .def("voxels", &voxels, py::arg("states") = "occupied",
           "The voxels in the given states ('occupied', 'free', 'occluded'; a list, or joined by commas): "
           "structured, with the centre x, y, z [m], the colour red, green, blue, and label, state, "
           "probability, occupancy, class_probability, variance, entropy [nat] and evidence. Sorted by "
           "block.\n\nRaises ValueError for an unknown state.")
      .def_property_readonly(
          "bounds", &mapBoundsOf,
          "The box that holds all blocks: its lower and its upper corner [m], (2, 3), float64. None if the "
          "map has no block.")
      .def_property_readonly("blocks", &blockIndices,
                             "The indices of all blocks, sorted by z, y, x: (N, 3), int32.")
      .def("block", &blockAt, py::arg("index"), "The block with an index, or None if the map has none.")
      .def("save", &save, py::arg("path"),
           "Write a map file (.bkm), which holds all evidence without loss; an old file is replaced once the "
           "new one is complete.\n\nRaises ValueError for another ending, MapFileError if the file cannot be "
           "written.")
      .def("export", &exportTo, py::arg("path"), py::arg("states") = py::none(),
           py::arg("min_z") = ColumnRules().min_z, py::arg("max_z") = ColumnRules().max_z,
           py::arg("height") = "map",
           "Write a file for other programs: .ply or .pcd, the voxels in `states` as points (default: "
           "occupied); .html, a page for browsers with the voxels in `states` (default: all); .ot or .bt, an "
           "OctoMap; .yaml, with an image .pgm beside it, for map_server, with obstacles from min_z to max_z "
           "[m] above the origin of the map frame (height 'map') or the ground (height 'ground'); .glb, a "
           "mesh of the occupied voxels.\n\nRaises ValueError for another ending, RuntimeError if the file "
           "cannot be written.")
      .def("__repr__", &mapDescription);
  addQueries(m, map);
}

}  // namespace bki_mapping::python
