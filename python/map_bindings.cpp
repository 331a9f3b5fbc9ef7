#include "map_bindings.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "arrays.h"
#include "bki_mapping/core/named_parameter.h"
#include "bki_mapping/io/class_table_yaml.h"
#include "bki_mapping/io/map_export.h"
#include "bki_mapping/io/mapper_file.h"
#include "bki_mapping/map/map_query.h"
#include "io/export_file.h"

namespace bki_mapping::python {
namespace {

using SharedClasses = std::shared_ptr<ClassTable>;

/// A block of a map, which it keeps alive.
struct MapBlock {
  SharedMap map;
  BlockIndex index;
  const Block* block;
};

/// Calls visit(i, block, offset) for each point; the block is nullptr where the map has none, also beyond the
/// grid's indices. @throws std::invalid_argument if a point is not finite.
template <typename Visit>
void forEachVoxel(const SemanticMap& map, const Points& points, Visit&& visit) {
  const GridGeometry& grid = map.geometry();
  BlockIndex last{{1 << 30, 0, 0}};  // no block has this index
  const Block* block = nullptr;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d point = points.at(i);
    if (!grid.contains(point)) {
      if (point.allFinite()) {
        visit(i, static_cast<const Block*>(nullptr), 0);
        continue;
      }
      throw std::invalid_argument("points[" + std::to_string(i) + "] is not finite; leave such points out");
    }
    const VoxelIndex voxel = grid.voxelAt(point);
    const BlockIndex index = GridGeometry::blockOf(voxel);
    if (index != last) {
      block = map.find(index);
      last = index;
    }
    visit(i, block, GridGeometry::offsetInBlock(voxel));
  }
}

/// An array with one value for each point. @param of T(const VoxelView&).
template <typename T, typename Of>
py::array_t<T> queried(const SemanticMap& map, py::handle object, Of of) {
  const Points points(object, "points");
  py::array_t<T> result(static_cast<py::ssize_t>(points.size()));
  T* const to = result.mutable_data();
  const py::gil_scoped_release release;
  const T unknown = of(viewVoxel(map, Block(), 0));
  forEachVoxel(map, points, [&](std::size_t i, const Block* block, int offset) {
    to[i] = block ? of(viewWithoutEntropy(map, *block, offset)) : unknown;
  });
  return result;
}

py::array query(const StoredMap& stored, py::handle object) {
  const Points points(object, "points");
  std::vector<VoxelView> views(points.size());
  {
    const py::gil_scoped_release release;
    const VoxelView unknown = viewVoxel(stored.map, Block(), 0);
    forEachVoxel(stored.map, points, [&](std::size_t i, const Block* block, int offset) {
      views[i] = block ? viewVoxel(stored.map, *block, offset) : unknown;
    });
  }
  using V = VoxelView;
  return ownedArray(std::move(views), structType({{"state", "u1", offsetof(V, state)},
                                                  {"label", "u1", offsetof(V, label)},
                                                  {"probability", "f4", offsetof(V, probability)},
                                                  {"variance", "f4", offsetof(V, variance)},
                                                  {"occupancy", "f4", offsetof(V, occupancy)},
                                                  {"class_probability", "f4", offsetof(V, class_probability)},
                                                  {"entropy", "f4", offsetof(V, entropy)},
                                                  {"evidence", "f4", offsetof(V, evidence)}},
                                                 sizeof(V)));
}

py::array_t<float> posterior(const StoredMap& stored, py::handle object) {
  const Points points(object, "points");
  const std::vector<SemanticClass>& classes = stored.info.classes->classes();
  const std::size_t columns = classes.size() + 1;
  py::array_t<float> result({static_cast<py::ssize_t>(points.size()), static_cast<py::ssize_t>(columns)});
  float* const to = result.mutable_data();
  const py::gil_scoped_release release;
  std::vector<std::size_t> column_of(kMaxClasses + 2, 0);
  for (std::size_t c = 0; c < classes.size(); ++c) column_of[classes[c].id] = c;
  column_of[kFreeClass] = classes.size();
  const double prior = stored.map.prior();
  std::vector<double> alpha(columns);
  forEachVoxel(stored.map, points, [&](std::size_t i, const Block* block, int offset) {
    std::fill(alpha.begin(), alpha.end(), prior);
    double sum = stored.map.priorSum();
    if (block) {
      for (std::size_t p = 0; p < block->classes().size(); ++p) {
        const auto evidence = static_cast<double>(evidenceOf(block->plane(p)[offset]));
        alpha[column_of[block->classes()[p]]] += evidence;
        sum += evidence;
      }
    }
    for (std::size_t c = 0; c < columns; ++c) to[i * columns + c] = static_cast<float>(alpha[c] / sum);
  });
  return result;
}

py::array voxels(const StoredMap& stored, py::handle states) {
  const VoxelStates wanted = parseStates(wordsOf(states, "states"));
  std::vector<VoxelRecord> records;
  {
    const py::gil_scoped_release release;
    records = collectVoxels(stored.map, *stored.info.classes, wanted);
  }
  using V = VoxelRecord;
  return ownedArray(std::move(records),
                    structType({{"x", "f4", offsetof(V, x)},
                                {"y", "f4", offsetof(V, y)},
                                {"z", "f4", offsetof(V, z)},
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

void exportTo(const StoredMap& stored, py::handle path, py::handle states, double min_z, double max_z,
              const std::string& height) {
  ExportOptions options;
  options.states = parseStates(wordsOf(states, "states"));
  options.columns.min_z = min_z;
  options.columns.max_z = max_z;
  options.columns.reference = parseHeightReference(height);
  if (!(min_z <= max_z)) throw std::invalid_argument("min_z must not be above max_z");
  const std::string file = pathOf(path, "path");
  const py::gil_scoped_release release;
  checkExport(file);
  exportFile(file, stored.map, *stored.info.classes, options);
}

void save(const StoredMap& stored, py::handle path) {
  const std::string file = pathOf(path, "path");
  if (!isMapFileName(file)) throw std::invalid_argument("the map file, " + file + ", must end in .bkm");
  const py::gil_scoped_release release;
  saveMap(file, stored.info, stored.drives, stored.map);
}

std::string description(const StoredMap& stored) {
  return "<bki_mapping.Map: " + std::to_string(stored.map.size()) + " blocks of 8 x 8 x 8 voxels of " +
         numberText(stored.info.resolution) + " m, frame '" + stored.info.frame + "', classes '" +
         stored.info.classes->name() + "'>";
}

/// A read-only view of planes: the array's base is the block, which keeps the map alive.
py::array planesOf(const py::object& self) {
  const auto& block = py::cast<const MapBlock&>(self);
  const auto count = static_cast<py::ssize_t>(block.block->classes().size());
  constexpr py::ssize_t kEdge = kBlockEdge;
  const EvidenceUnits* const data = count > 0 ? block.block->plane(0) : nullptr;
  py::array array(py::dtype::of<EvidenceUnits>(), {count, kEdge, kEdge, kEdge}, data, self);
  array.attr("setflags")(false);
  return array;
}

py::array planeOf(const py::object& self, int id) {
  const std::vector<ClassId>& classes = py::cast<const MapBlock&>(self).block->classes();
  const auto found = std::find(classes.begin(), classes.end(), id);
  if (found == classes.end()) {
    throw std::invalid_argument("the block has no plane of class " + std::to_string(id) +
                                "; see Block.classes for those that it has");
  }
  return planesOf(self)[py::int_(found - classes.begin())];
}

std::vector<std::string> flagsOf(const SemanticClass& c) {
  std::vector<std::string> flags;
  for (const auto& [set, name] :
       {std::pair(c.unlabelled, "unlabelled"), std::pair(c.dynamic, "dynamic"), std::pair(c.living, "living"),
        std::pair(c.ground, "ground"), std::pair(c.ignored, "ignored")}) {
    if (set) flags.emplace_back(name);
  }
  return flags;
}

const SemanticClass& classAt(const ClassTable& table, py::handle key) {
  for (const SemanticClass& c : table.classes()) {
    const bool named = py::isinstance<py::str>(key) && py::cast<std::string>(key) == c.name;
    if (named || (PyIndex_Check(key.ptr()) != 0 && py::int_(c.id).equal(key))) return c;
  }
  throw py::key_error("class table '" + table.name() + "' has no class " +
                      py::cast<std::string>(py::repr(key)));
}

py::array_t<std::uint8_t> colorsOf(const ClassTable& table) {
  py::array_t<std::uint8_t> colors({256, 3});
  std::fill_n(colors.mutable_data(), colors.size(), std::uint8_t{255});
  for (const SemanticClass& c : table.classes()) {
    std::copy(c.color.begin(), c.color.end(), colors.mutable_data(c.id, 0));
  }
  return colors;
}

void addClassTable(py::module& m) {
  py::class_<SemanticClass>(m, "SemanticClass", "A class of a table.")
      .def_readonly("id", &SemanticClass::id, "Unique in the table, 0 to 253.")
      .def_readonly("name", &SemanticClass::name, "Unique in the table.")
      .def_property_readonly(
          "color", [](const SemanticClass& c) { return py::make_tuple(c.color[0], c.color[1], c.color[2]); },
          "Red, green and blue, 0 to 255.")
      .def_readonly("raw", &SemanticClass::raw, "Labels of the data set that mean this class.")
      .def_property_readonly("flags", &flagsOf,
                             "Those of the file: unlabelled, dynamic, living, ground, ignored.")
      .def("__repr__", [](const SemanticClass& c) {
        return "<bki_mapping.SemanticClass " + std::to_string(c.id) + ": '" + c.name + "'>";
      });
  py::class_<ClassTable, SharedClasses>(
      m, "ClassTable", "Which classes a data set has, and which labels stand for them. Does not change.")
      .def(py::init([](py::handle name_or_file) {
             return std::make_shared<ClassTable>(loadClassTable(pathOf(name_or_file, "name_or_file")));
           }),
           py::arg("name_or_file"),
           "Read a class table: one that comes with the package by its name, such as 'semantic_kitti', or a "
           "YAML file.\n\nRaises ValueError if there is no such table, or the file is no class table.")
      .def_property_readonly("name", &ClassTable::name, "The name of the table.")
      .def_property_readonly("colors", &colorsOf,
                             "The colour of each class id: (256, 3), uint8; white where no class has the id.")
      .def("__len__", &ClassTable::size)
      .def(
          "__iter__",
          [](const ClassTable& table) {
            return py::make_iterator(table.classes().begin(), table.classes().end());
          },
          py::keep_alive<0, 1>())
      .def("__getitem__", &classAt, py::arg("id_or_name"), py::return_value_policy::reference_internal,
           "The class with an id or a name. Raises KeyError if there is none.")
      .def("__repr__", [](const ClassTable& table) {
        return "<bki_mapping.ClassTable '" + table.name() + "' of " + std::to_string(table.size()) +
               " classes>";
      });
}

void addBlock(py::module& m) {
  py::class_<MapBlock>(m, "Block", "The evidence of 8 x 8 x 8 voxels. Keeps its map alive.")
      .def_property_readonly(
          "index", [](const MapBlock& b) { return py::make_tuple(b.index.x, b.index.y, b.index.z); },
          "The block's index in the grid of blocks.")
      .def_property_readonly(
          "origin",
          [](const MapBlock& b) {
            const Eigen::Vector3d origin = b.map->map.geometry().blockOrigin(b.index);
            return py::array_t<double>(3, origin.data());
          },
          "The corner of the block with the smallest coordinates, map frame [m].")
      .def_property_readonly(
          "classes",
          [](const MapBlock& b) {
            const std::vector<ClassId>& classes = b.block->classes();
            return py::array_t<ClassId>(static_cast<py::ssize_t>(classes.size()), classes.data());
          },
          "The ids of the classes of which a voxel has evidence, rising; FREE_CLASS for free space.")
      .def_property_readonly(
          "planes", &planesOf,
          "The evidence of each class of `classes` at each voxel: (classes, 8, 8, 8), int32, by class, z, y, "
          "x, in units of EVIDENCE_UNIT. A read-only view; nothing is copied.")
      .def("plane", &planeOf, py::arg("class_id"),
           "The plane of one class: (8, 8, 8), int32, by z, y, x. A read-only view.\n\nRaises ValueError if "
           "the block has none.")
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
  const Block* const block = map->map.find(index);
  return block ? py::cast(MapBlock{map, index, block}) : py::none();
}

py::array_t<std::int32_t> blockIndices(const StoredMap& stored) {
  std::vector<GridIndex> indices;
  for (const auto& [index, block] : sortedBlocks(stored.map)) indices.push_back(index);
  return indexArray(indices);
}

}  // namespace

void addMap(py::module& m) {
  addClassTable(m);
  addBlock(m);
  addDrive(m);
  py::class_<StoredMap, SharedMap>(
      m, "Map",
      "A map that does not change: a snapshot of a mapper's, or one from a file. Queries take points in the "
      "map frame [m], as an array of shape (N, 3), float32 or float64 without a copy, and release the GIL. "
      "Points where nothing was mapped are unknown. They raise ValueError for a point that is not finite.")
      .def_property_readonly(
          "resolution", [](const StoredMap& s) { return s.info.resolution; }, "Edge of a voxel [m].")
      .def_property_readonly(
          "prior", [](const StoredMap& s) { return s.info.prior; },
          "Concentration of each class, and of free, before any scan.")
      .def_property_readonly(
          "frame", [](const StoredMap& s) { return s.info.frame; }, "Name of the map frame.")
      .def_property_readonly(
          "parameters", [](const StoredMap& s) { return s.info.parameters; },
          "The settings of the mapper that made the map, as YAML.")
      .def_property_readonly(
          "classes", [](const StoredMap& s) { return std::const_pointer_cast<ClassTable>(s.info.classes); },
          "The class table.")
      .def_readonly("drives", &StoredMap::drives, "The drives whose scans are in the map.")
      .def_property_readonly(
          "bytes", [](const StoredMap& s) { return s.map.bytes(); },
          "Memory of the map [bytes], including what it shares with snapshots.")
      .def(
          "states",
          [](const StoredMap& s, py::handle points) {
            return queried<std::uint8_t>(
                s.map, points, [](const VoxelView& v) { return static_cast<std::uint8_t>(v.state); });
          },
          py::arg("points"), "The state of each voxel: UNKNOWN, FREE, OCCUPIED or OCCLUDED; (N,), uint8.")
      .def(
          "labels",
          [](const StoredMap& s, py::handle points) {
            return queried<std::uint8_t>(s.map, points, [](const VoxelView& v) { return v.label; });
          },
          py::arg("points"), "The class id of each occupied voxel; FREE_CLASS elsewhere; (N,), uint8.")
      .def(
          "probabilities",
          [](const StoredMap& s, py::handle points) {
            return queried<float>(s.map, points, [](const VoxelView& v) { return v.probability; });
          },
          py::arg("points"),
          "The probability of the class that `labels` gives, which is that of free where no class is given; "
          "(N,), float32.")
      .def(
          "variances",
          [](const StoredMap& s, py::handle points) {
            return queried<float>(s.map, points, [](const VoxelView& v) { return v.variance; });
          },
          py::arg("points"), "The variance of `probabilities` under the posterior; (N,), float32.")
      .def("posterior", &posterior, py::arg("points"),
           "The expected probability of every class, in the order of the class table, and, last, of free; "
           "(N, number of classes + 1), float32. Rows sum to 1.")
      .def("query", &query, py::arg("points"),
           "All that the map says of each voxel: (N,), structured, with the fields state, label, "
           "probability, variance, occupancy, class_probability, entropy [nat] and evidence. Slower than the "
           "other queries, for entropy takes logarithms.")
      .def("voxels", &voxels, py::arg("states") = "occupied",
           "The voxels in the given states ('occupied', 'free', 'occluded'; a list, or joined by commas): "
           "structured, with the centre x, y, z [m], the colour red, green, blue, and label, state, "
           "probability, occupancy, class_probability, variance, entropy [nat] and evidence. Sorted by "
           "block.\n\nRaises ValueError for an unknown state.")
      .def_property_readonly("blocks", &blockIndices,
                             "The indices of all blocks, sorted by z, y, x: (N, 3), int32.")
      .def("block", &blockAt, py::arg("index"), "The block with an index, or None if the map has none.")
      .def("save", &save, py::arg("path"),
           "Write a map file (.bkm), which holds all evidence without loss; an old file is replaced once the "
           "new one is complete.\n\nRaises ValueError for another ending, MapFileError if the file cannot be "
           "written.")
      .def("export", &exportTo, py::arg("path"), py::arg("states") = "occupied",
           py::arg("min_z") = ColumnRules().min_z, py::arg("max_z") = ColumnRules().max_z,
           py::arg("height") = "map",
           "Write a file for other programs: .ply or .pcd, the voxels in `states` as points; .ot or .bt, an "
           "OctoMap; .yaml, with an image .pgm beside it, for map_server, with obstacles from min_z to max_z "
           "[m] above the origin of the map frame (height 'map') or the ground (height 'ground').\n\nRaises "
           "ValueError for another ending, RuntimeError if the file cannot be written.")
      .def("__repr__", &description);
}

}  // namespace bki_mapping::python
