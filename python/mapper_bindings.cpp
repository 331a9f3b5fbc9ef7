#include <pybind11/stl.h>

#include <mutex>
#include <stdexcept>
#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "bki_mapping/mapping/mapper_config.h"
#include "bki_mapping/mapping/semantic_mapper.h"
#include "bki_mapping/settings/yaml.h"
#include "bki_mapping/store/mapper_file.h"
#include "core/frame_name.h"
#include "journal/journal_output.h"
#include "settings/label_watch.h"
#include "store/drives.h"

namespace bki_mapping::python {
namespace {

using SharedClasses = std::shared_ptr<const ClassTable>;

/// A mapper, and which drives are in its map. Its calls release the GIL; those of several threads wait for
/// each other.
struct Mapper {
  Mapper(const MapperConfig& config, SharedClasses classes, const std::string& map_frame,
         const std::string& id)
      : mapper(config, std::move(classes)), frame(frameName(map_frame)) {
    drive.id = id;
  }

  std::mutex mutex;
  SemanticMapper mapper;
  std::string frame;
  std::unique_ptr<KeptScans> kept;  ///< the scans that were integrated here; nullptr without a journal
  LabelWatch labels;
  DriveRecord drive;                ///< of the scans that were integrated here
  std::vector<DriveRecord> drives;  ///< those added from files and other maps
};

/// Calls a function without the GIL, alone in the mapper.
template <typename Function>
auto alone(Mapper& self, Function&& function) {
  const py::gil_scoped_release release;
  const std::lock_guard<std::mutex> lock(self.mutex);
  return function();
}

MapperConfig configOf(py::handle config, py::handle resolution, py::dict parameters) {
  MapperConfig result;
  if (!config.is_none()) setParameters(result, loadParameterFile(pathOf(config, "config")));
  if (!resolution.is_none()) parameters["resolution"] = resolution;
  setParameters(result, settingsOf(parameters));
  return result;
}

void warnOf(const MapperConfig& config, const ClassTable& classes) {
  for (const std::string& warning : settingWarnings(config, classes)) warn(warning);
}

SharedClasses classesOf(py::handle classes) {
  if (py::isinstance<ClassTable>(classes)) return py::cast<std::shared_ptr<ClassTable>>(classes);
  return std::make_shared<const ClassTable>(loadClassTable(pathOf(classes, "classes")));
}

/// An id that no other drive has, whatever robot records it.
std::string newId() {
  return py::str(py::module::import("uuid").attr("uuid4")());
}

std::unique_ptr<Mapper> makeMapper(py::handle classes, py::handle resolution, py::handle config,
                                   const std::string& frame, py::handle drive, py::handle journal,
                                   const py::kwargs& parameters) {
  const MapperConfig settings = configOf(config, resolution, parameters);
  const std::string id = drive.is_none() ? newId() : py::cast<std::string>(py::str(drive));
  if (id.empty()) throw std::invalid_argument("drive is empty; give an id that no other drive has, or none");
  auto mapper = std::make_unique<Mapper>(settings, classesOf(classes), frame, id);
  if (!journal.is_none()) {
    MapCorrector::Settings of_journal;
    of_journal.quantum = numberOf(journal, "journal");
    if (!(of_journal.quantum >= 1e-4 && of_journal.quantum <= 1.0)) {
      throw std::invalid_argument("journal is " + numberText(of_journal.quantum) +
                                  ", but must be from 0.0001 to 1");
    }
    mapper->kept = std::make_unique<KeptScans>(mapper->mapper, of_journal);
  }
  warnOf(settings, mapper->mapper.classes());
  return mapper;
}

/// Where the sensor was.
struct Pose {
  Eigen::Isometry3d T_map_sensor;
  Eigen::Matrix3f rotation;
  bool turned;
};

/// @param object an origin, (3,), or T_map_sensor, (4, 4).
Pose poseOf(py::handle object) {
  const py::array array =
      arrayOf(object, "origin", "three numbers, or a pose: an array of numbers of shape (4, 4)");
  if (array.ndim() != 2) {
    return {Eigen::Isometry3d(Eigen::Translation3d(vectorOf(object, "origin"))), Eigen::Matrix3f::Identity(),
            false};
  }
  const auto values = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(array);
  if (!values) PyErr_Clear();
  if (!values || array.shape(0) != 4 || array.shape(1) != 4) {
    throw std::invalid_argument(
        "origin must be three numbers, or a pose: an array of numbers of shape (4, 4)");
  }
  const Eigen::Matrix4d matrix =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(values.data());
  if (!isPose(matrix)) {
    throw std::invalid_argument(
        "the pose must be a rotation and a translation, from the sensor's to the map frame, with 0, 0, 0, 1 "
        "in the last row");
  }
  Eigen::Isometry3d T_map_sensor;
  T_map_sensor.matrix() = matrix;
  return {T_map_sensor, roundedRotation(T_map_sensor), true};
}

/// Points in single precision, relative to the sensor, in the axes of the map frame.
std::vector<Eigen::Vector3f> relativePoints(const Points& points, const Pose& pose, bool in_map) {
  std::vector<Eigen::Vector3f> relative(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (in_map) {
      relative[i] = (points.at(i) - pose.T_map_sensor.translation()).cast<float>();
    } else {
      const Eigen::Vector3f point = points.isFloat() ? points.floats()[i] : points.at(i).cast<float>();
      relative[i] = pose.turned ? pose.rotation * point : point;
    }
  }
  return relative;
}

bool areInMap(const std::string& points_in) {
  if (points_in == "map") return true;
  if (points_in == "sensor") return false;
  throw std::invalid_argument("points_in is '" + points_in + "', but must be sensor or map");
}

/// @param in_map whether the points of the scan are in the axes of the map also if scans are kept.
ScanStats addToMap(Mapper& self, const ScanView& scan, const Eigen::Isometry3d& T_map_sensor, bool in_map) {
  if (!self.kept) return self.mapper.integrate(scan);
  self.kept->update();
  return in_map ? self.kept->integrate(scan, T_map_sensor) : self.kept->integrateRecorded(scan, T_map_sensor);
}

ScanStats addOrWithdraw(Mapper& self, py::handle origin, py::handle points, py::handle labels,
                        py::handle scan_stamp, py::handle points_in, py::handle labels_are_ids,
                        bool withdraws) {
  const std::uint64_t stamp = stampOf(scan_stamp);
  const bool in_map = areInMap(textOf(points_in, "points_in"));
  Pose pose = poseOf(origin);
  const Points given(points, "points");
  const Labels classes(labels, "labels");
  ScanView scan;
  scan.origin = pose.T_map_sensor.translation();
  scan.labels = {classes.data(), classes.size()};
  scan.labels_are_ids = truthOf(labels_are_ids, "labels_are_ids");
  scan.stamp = stamp;
  std::string warning;
  const ScanStats added = alone(self, [&] {
    if (withdraws && self.kept) {
      throw std::invalid_argument("a mapper with a journal keeps its scans; withdraw them without one");
    }
    std::vector<Eigen::Vector3f> relative;
    if (self.kept) pose.turned = false;  // what is kept is rounded in the axes of the sensor
    if (in_map || pose.turned || !given.isFloat()) {
      relative = relativePoints(given, pose, in_map);
      scan.points = {relative.data(), relative.size()};
    } else {
      scan.points = {given.floats(), given.size()};
    }
    if (withdraws) {
      const ScanStats stats = self.mapper.withdraw(scan);
      if (self.drive.scans > 0) --self.drive.scans;
      return stats;
    }
    const ScanStats stats = addToMap(self, scan, pose.T_map_sensor, in_map);
    self.drive.addScan(stamp, self.mapper.map().geometry(), self.mapper.touchedBlocks());
    warning = self.labels.report(self.mapper, scan, stats.counts);
    return stats;
  });
  if (!warning.empty()) warn(warning);
  return added;
}

ScanStats integrate(Mapper& self, py::handle origin, py::handle points, py::handle labels, py::handle stamp,
                    py::handle points_in, py::handle labels_are_ids) {
  return addOrWithdraw(self, origin, points, labels, stamp, points_in, labels_are_ids, false);
}
ScanStats withdraw(Mapper& self, py::handle origin, py::handle points, py::handle labels, py::handle stamp,
                   py::handle points_in, py::handle labels_are_ids) {
  return addOrWithdraw(self, origin, points, labels, stamp, points_in, labels_are_ids, true);
}

std::vector<DriveRecord> drivesOf(const Mapper& self) {
  std::vector<DriveRecord> drives = self.drives;
  if (self.drive.scans > 0) drives.push_back(self.drive);
  return drives;
}

SharedMap snapshot(Mapper& self) {
  return alone(self, [&] {
    std::vector<DriveRecord> drives = drivesOf(self);
    MapSnapshot taken = self.mapper.snapshot();
    return std::make_shared<FixedMap>(
        RuledMap{{mapInfoOf(self.mapper, self.frame), std::move(drives), std::move(taken.map)}, taken.rules},
        self.mapper.config().threads);
  });
}

void saveMapper(Mapper& self, const py::object& path) {
  if (!self.kept) return static_cast<void>(py::cast(snapshot(self)).attr("save")(path));
  const std::string file = pathOf(path, "path");
  if (!isMapFileName(file)) throw std::invalid_argument("a map file's name must end in .bkm: " + file);
  alone(self, [&] {
    self.kept->finish();
    JournalOutput journal;
    journal.kept = self.kept.get();
    journal.drive = self.drive.id;
    saveWithJournal(file, self.mapper, self.frame, drivesOf(self), std::move(journal));
  });
}

/// Adds a map, unless its scans are there already.
void addStored(Mapper& self, const StoredMap& added, bool allow_overlap) {
  checkNotAdded("the map", self.drives, added.drives, allow_overlap);
  if (self.drive.scans > 0) checkNotAdded("the map", {self.drive}, added.drives, allow_overlap);
  self.mapper.addMap(added.map);
  if (self.kept) self.kept->noteForeign(added.map.regions());
  self.drives.insert(self.drives.end(), added.drives.begin(), added.drives.end());
}

void add(Mapper& self, const FixedMap& added, bool allow_overlap) {
  const StoredMap& map = added.stored;
  alone(self, [&] {
    checkSameGrid("the mapper", mapInfoOf(self.mapper, self.frame), "the added map", map.info);
    if (map.info.frame != self.frame) {
      throw std::invalid_argument("the added map is in frame '" + map.info.frame +
                                  "', and the mapper's in '" + self.frame +
                                  "'; move it there with bki_mapping.merge");
    }
    addStored(self, map, allow_overlap);
  });
}

void addFile(Mapper& self, py::handle path, bool allow_overlap) {
  const std::string file = pathOf(path, "path");
  alone(self, [&] { addStored(self, loadMapFor(self.mapper, file, self.frame), allow_overlap); });
}

void reset(Mapper& self) {
  const std::string id = newId();
  alone(self, [&] {
    self.mapper.reset();
    if (self.kept) self.kept->reset();
    self.drives.clear();
    self.drive = {};
    self.drive.id = id;
  });
}

void reconfigure(Mapper& self, const py::kwargs& parameters) {
  const std::map<std::string, std::string> values = settingsOf(parameters);
  const MapperConfig config = alone(self, [&] {
    MapperConfig changed = self.mapper.config();
    setParameters(changed, values);
    if (self.kept) MapCorrector::checkCorrectable(changed);
    self.mapper.reconfigure(changed);
    if (self.kept) self.kept->corrector().reconfigure(changed);
    return changed;
  });
  warnOf(config, self.mapper.classes());
}

py::array_t<std::int32_t> clearBox(Mapper& self, py::handle low, py::handle high) {
  const Eigen::AlignedBox3d box(vectorOf(low, "low"), vectorOf(high, "high"));
  if (box.isEmpty()) throw std::invalid_argument("low must not be above high, on any axis");
  return indexArray(alone(self, [&] {
    if (self.kept) self.kept->noteCleared(box);
    return self.mapper.clearBox(box);
  }));
}

py::dict parameters(Mapper& self) {
  const MapperConfig config = alone(self, [&] { return self.mapper.config(); });
  py::dict values;
  for (const Parameter& parameter : mapperParameters()) {
    const std::string text = parameter.get(config);
    py::object value = py::str(text);
    if (parameter.type == ParameterType::kReal) value = py::float_(parseNumber(text));
    if (parameter.type == ParameterType::kInteger) value = py::int_(py::str(text));
    if (parameter.type == ParameterType::kTruth) value = py::bool_(text == "true");
    values[py::str(parameter.name)] = value;
  }
  return values;
}

void addStats(py::module& m) {
  using C = PointCounts;
  using S = ScanStats;
  py::class_<ScanStats> stats(m, "ScanStats", "What one scan added, and how long it took.");
  const auto count = [&](const char* name, std::size_t C::*field, const char* text) {
    stats.def_property_readonly(
        name, [field](const S& s) { return s.counts.*field; }, text);
  };
  count("points", &C::points, "Points of the scan; the sum of `used` to `no_returns`.");
  count("used", &C::used, "Points that became hits.");
  count("not_finite", &C::not_finite, "Points with a coordinate that is not finite.");
  count("at_sensor", &C::at_sensor, "Points within 1 mm of the sensor.");
  count("too_near", &C::too_near, "Points closer than sensor_model/min_range.");
  count("beyond_max", &C::beyond_max, "Points beyond sensor_model/max_range.");
  count("outside_map", &C::outside_map, "Points too far from the map's origin.");
  count("unknown_label", &C::unknown_label,
        "Points dropped because the class table does not list their label.");
  count("unlabelled", &C::unlabelled, "Points of the unlabelled class that were dropped.");
  count("airborne", &C::airborne, "Points of classes with the flag airborne.");
  count("isolated", &C::isolated, "Points taken for drops, flakes, fog or dust: rules/particles_within.");
  count("no_direction", &C::no_direction, "Beams without a return whose direction is not known.");
  count("no_returns", &C::no_returns, "Beams without a return.");
  stats.def_readonly("hits", &S::hits, "Hits after down-sampling.")
      .def_readonly("half_range", &S::half_range, "Range within which half of the used points are [m].")
      .def_readonly("free_count", &S::free_count, "Free samples after down-sampling, or beams.")
      .def_readonly("blocks", &S::blocks, "Blocks that the scan touched.")
      .def_readonly("saturated", &S::saturated,
                    "Voxels and classes whose evidence stopped at the end of its range.")
      .def_readonly("negative", &S::negative,
                    "Voxels and classes from which withdraw() took more than they had.")
      .def_property_readonly("total_ms", &S::totalMs, "Time of the scan [ms].")
      .def("__repr__", [](const S& s) {
        return "<bki_mapping.ScanStats: " + std::to_string(s.counts.used) + " of " +
               std::to_string(s.counts.points) + " points used, " + std::to_string(s.blocks) + " blocks, " +
               numberText(s.totalMs()) + " ms>";
      });
}

constexpr char kMapperHelp[] =
    "Builds a map from labelled lidar scans.\n\n"
    "classes: a class table that comes with the package, by its name, a YAML file, or a ClassTable.\n"
    "resolution: edge of a voxel [m]; 0.3 unless the configuration says otherwise.\n"
    "config: a preset that comes with the package, by its name, such as 'robot', or a YAML file of "
    "parameters.\n"
    "frame: name of the map frame, which map files keep.\n"
    "drive: what map files call the scans; an id that no other drive has. None: a random one.\n"
    "journal: keep the scans, so that save() writes them into the map file, where correct() moves them; "
    "their "
    "points are rounded to multiples of this length in the sensor's frame [m], such as 0.01. None: no.\n"
    "parameters: those of docs/parameters.md, overriding the configuration: **{'free_space/mode': 'line'}, "
    "or nested, free_space={'mode': 'line'}.\n\n"
    "Calls release the GIL, and those of several threads wait for each other. Raises ValueError for an "
    "unknown class table, an unknown parameter, or a value that is not allowed.";
constexpr char kIntegrateHelp[] =
    "Add one scan, either all of it or nothing.\n\n"
    "origin: position of the sensor in the map frame [m], (3,), if its axes are those of the map frame; "
    "otherwise its pose T_map_sensor, (4, 4).\n"
    "points: hits in the sensor's frame [m], (N, 3); with points_in='map' in the map frame, for which "
    "float64 is better. Points that are not finite are skipped, and counted. Contiguous float32 is not "
    "copied if `origin` is a position. Do not change the arrays meanwhile.\n"
    "labels: integers, (N,): labels of the data set, which the class table translates; with "
    "labels_are_ids=True, ids of the table; -1 for points without a label. Contiguous uint32 is not copied. "
    "A "
    "UserWarning names each label that the table does not list once, and the remedy.\n"
    "stamp: time of the scan [ns]; random free samples depend on it.\n\n"
    "Raises ValueError if shapes or lengths are wrong, ScanRefused if the scan exceeds a limit; the map is "
    "then unchanged.";

}  // namespace

void addMapper(py::module& m) {
  addStats(m);
  const py::arg_v stamp = py::arg("stamp") = 0, in = py::arg("points_in") = "sensor",
                  ids = py::arg("labels_are_ids") = false;
  py::class_<Mapper>(m, "SemanticMapper", kMapperHelp)
      .def(py::init(&makeMapper), py::arg("classes") = "semantic_kitti", py::arg("resolution") = py::none(),
           py::arg("config") = py::none(), py::arg("frame") = "map", py::arg("drive") = py::none(),
           py::arg("journal") = py::none(), "The arguments are explained with the class.")
      .def("integrate", &integrate, py::arg("origin"), py::arg("points"), py::arg("labels"), stamp, in, ids,
           kIntegrateHelp)
      .def("withdraw", &withdraw, py::arg("origin"), py::arg("points"), py::arg("labels"), stamp, in, ids,
           "Take back a scan that was integrated with these arguments: its looks stay (rules/latest); "
           "otherwise "
           "the map is then the same to the bit "
           "as if the scan had never been there.\n\nRaises RuntimeError with free_space/extent 'mapped' or "
           "occlusion marks, which depend on the order of scans; otherwise as integrate.")
      .def("snapshot", &snapshot,
           "The map as it is, to be read while mapping goes on. Takes far less than a scan.")
      .def_property_readonly("map", &snapshot, "The same as snapshot().")
      .def("add", &add, py::arg("map"), py::arg("allow_overlap") = false,
           "Add another map: the map is then the same to the bit as if the scans of both had been integrated "
           "here.\n\n"
           "allow_overlap: add drives that share scans with the map's according to their ids, too.\n\n"
           "Raises ValueError if grids, classes or frames differ, or a drive is in both.")
      .def("load", &addFile, py::arg("path"), py::arg("allow_overlap") = false,
           "Add the map of a map file (.bkm), to go on with it.\n\n"
           "allow_overlap: as for add.\n\nRaises MapFileError if the file cannot be "
           "read, or has another grid, class table or frame; ValueError if a drive is in both.")
      .def(
          "save", &saveMapper, py::arg("path"),
          "Write a map file (.bkm), which holds all evidence without loss, and with `journal` the scans that "
          "were integrated here. Without it, other threads may map meanwhile.\n\nRaises ValueError for "
          "another ending, MapFileError if the file cannot be written.")
      .def("reset", &reset, "Clear the map, and start a new drive.")
      .def("reconfigure", &reconfigure,
           "Change parameters that may change while mapping; the map stays. Raises ValueError for others.")
      .def("clear_box", &clearBox, py::arg("low"), py::arg("high"),
           "Erase all evidence of the voxels whose centres lie in a box, from corner `low` to `high`, map "
           "frame [m], which may be infinite. Returns the indices of the blocks that changed, (N, 3).")
      .def_property_readonly(
          "touched_blocks",
          [](Mapper& self) { return indexArray(alone(self, [&] { return self.mapper.touchedBlocks(); })); },
          "The indices of the blocks that the last scan may have changed: (N, 3), int32.")
      .def_property_readonly(
          "classes",
          [](Mapper& self) { return std::const_pointer_cast<ClassTable>(self.mapper.sharedClasses()); },
          "The class table.")
      .def_readonly("frame", &Mapper::frame, "Name of the map frame.")
      .def_property_readonly(
          "drive", [](Mapper& self) { return alone(self, [&] { return self.drive.id; }); },
          "What map files call the scans that are integrated here.")
      .def_property_readonly("parameters", &parameters, "All parameters, by their flat names.");
}

}  // namespace bki_mapping::python
