// The Python module bki_mapping._core. python/bki_mapping/__init__.py loads it when it is first used.
#include <pybind11/stl.h>

#include <memory>
#include <optional>

#include "arrays.h"
#include "bindings.h"
#include "bki_mapping/core/scan.h"
#include "bki_mapping/query/queries.h"
#include "bki_mapping/rules/voxel_state.h"
#include "bki_mapping/sequence/sequence.h"
#include "bki_mapping/store/map_merge.h"
#include "bki_mapping/store/mapper_file.h"
#include "sequence/pose_agreement.h"

namespace bki_mapping::python {
namespace {

MergeInput inputOf(py::handle input) {
  if (!py::isinstance<py::tuple>(input)) return {pathOf(input, "an input"), std::nullopt};
  const auto parts = py::reinterpret_borrow<py::tuple>(input);
  if (parts.size() != 3 || PyNumber_Check(py::object(parts[2]).ptr()) == 0) {
    throw std::invalid_argument("an input must be a path, or (path, translation, yaw)");
  }
  const MapPlacement placement{vectorOf(parts[1], "a translation"), py::cast<double>(py::float_(parts[2]))};
  return {pathOf(parts[0], "an input"), placement};
}

py::dict merge(const py::iterable& inputs, py::handle output, bool keep_drives,
               const std::vector<std::string>& without, bool allow_overlap) {
  if (py::isinstance<py::str>(inputs)) throw py::type_error("inputs must be a list of map files, not one");
  MergeOptions options;
  for (const py::handle input : inputs) options.inputs.push_back(inputOf(input));
  options.output = pathOf(output, "output");
  if (!isMapFileName(options.output)) {
    throw std::invalid_argument("the merged map, " + options.output + ", must end in .bkm");
  }
  options.keep_drives = keep_drives;
  options.without = without;
  options.allow_overlap = allow_overlap;
  MergeReport report;
  {
    const py::gil_scoped_release release;
    report = mergeMaps(options);
  }
  py::dict result;
  result["drives"] = report.drives;
  result["repeated"] = report.repeated;
  result["resampled"] = report.resampled;
  result["tiles"] = report.tiles;
  result["blocks"] = report.blocks;
  result["saturated"] = report.saturated;
  return result;
}

/// An array that shows a member of a frame, which it keeps alive.
template <typename T>
py::array view(const py::object& frame, const std::vector<T>& values) {
  return py::array(py::dtype::of<T>(), {static_cast<py::ssize_t>(values.size())}, values.data(), frame);
}

/// The position of a scan. @param i as Python counts; negative from the end. @throws pybind11::index_error.
std::size_t positionIn(const Sequence& sequence, py::ssize_t i) {
  const auto size = static_cast<py::ssize_t>(sequence.size());
  if (i < -size || i >= size) {
    throw py::index_error("the sequence has " + std::to_string(size) + " scans, and none has index " +
                          std::to_string(i));
  }
  return static_cast<std::size_t>(i < 0 ? i + size : i);
}

/// The number of scans before the first one without a pose.
std::size_t posedScans(const Sequence& sequence) {
  std::size_t i = 0;
  try {
    for (; i < sequence.size(); ++i) sequence.pose(i);
  } catch (const std::runtime_error&) {  // reported when the scan is read
  }
  return i;
}

/// Opens a folder, and warns of poses that seem to be those of the other sensor.
std::unique_ptr<Sequence> openSequence(const std::string& path, const SequenceOptions& options) {
  std::unique_ptr<Sequence> sequence;
  std::string warning;
  {
    const py::gil_scoped_release release;
    sequence = std::make_unique<Sequence>(path, options);
    warning = poseWarning(path, options, 0, posedScans(*sequence));
  }
  if (!warning.empty()) warn(warning);
  return sequence;
}

void addSequence(py::module& m) {
  using Frame = SequenceFrame;
  py::class_<Frame, std::shared_ptr<Frame>>(m, "Frame", "One scan of a sequence, in the sensor's frame.")
      .def_property_readonly(
          "points",
          [](const py::object& self) {
            const auto& points = py::cast<const Frame&>(self).points;
            const auto count = static_cast<py::ssize_t>(points.size());
            return py::array(py::dtype::of<float>(), {count, py::ssize_t{3}}, points.data(), self);
          },
          "The hits, sensor frame [m]: (N, 3), float32.")
      .def_property_readonly(
          "remissions",
          [](const py::object& self) { return view(self, py::cast<const Frame&>(self).remissions); },
          "The reflectivity of each hit: (N,), float32.")
      .def_property_readonly(
          "labels", [](const py::object& self) { return view(self, py::cast<const Frame&>(self).labels); },
          "The label of each hit, as in the file: (N,), uint32.")
      .def_property_readonly(
          "pose",
          [](const Frame& frame) {
            py::array_t<double> pose({4, 4});
            const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> matrix = frame.T_map_sensor.matrix();
            std::copy_n(matrix.data(), matrix.size(), pose.mutable_data());
            return pose;
          },
          "The sensor's pose in the map frame, T_map_sensor: (4, 4), float64.")
      .def_readonly("stamp", &Frame::stamp, "Time of the scan [ns].");
  py::class_<Sequence>(
      m, "Sequence",
      "A folder in SemanticKITTI's layout: velodyne/NNNNNN.bin, labels/NNNNNN.label, poses.txt, calib.txt "
      "and, optionally, times.txt. The map frame is the sensor's at the first pose.")
      .def(py::init([](py::handle folder, const std::optional<std::string>& labels, const py::object& poses,
                       const std::optional<std::string>& poses_in) {
             const std::string path = pathOf(folder, "folder");
             SequenceOptions options;
             options.labels = labels.value_or("");
             if (!poses.is_none()) options.map_poses = pathOf(poses, "poses");
             options.poses_in = sensorOf(poses_in);
             return openSequence(path, options);
           }),
           py::arg("folder"), py::arg("labels") = "labels", py::arg("poses") = py::none(),
           py::arg("poses_in") = py::none(),
           "Open a folder.\n\n"
           "labels: name of the folder with the labels, such as 'predictions'; None: the scans have no "
           "labels, and all are 0.\n"
           "poses: a file of poses in the map frame, instead of poses.txt, relative to its first pose.\n"
           "poses_in: which sensor the poses are of, 'camera' or 'lidar'; by default the camera, as in "
           "KITTI, and the lidar if poses have stamps.\n\n"
           "Without poses_in, warns if the scans agree much better with poses of the other sensor.\n"
           "Raises RuntimeError if a file is missing or wrong. A pose or time that is missing or wrong is "
           "reported when its scan is read.")
      .def("__len__", &Sequence::size)
      .def(
          "__getitem__",
          [](const Sequence& sequence, py::ssize_t i) {
            const std::size_t position = positionIn(sequence, i);
            const py::gil_scoped_release release;
            return std::make_shared<Frame>(sequence.read(position));
          },
          py::arg("i"),
          "Read scan i, counted from 0 over the scans that exist.\n\nRaises IndexError beyond the last, "
          "RuntimeError if a file cannot be read, or has not one label for each point.")
      .def(
          "name",
          [](const Sequence& sequence, py::ssize_t i) { return sequence.name(positionIn(sequence, i)); },
          py::arg("i"), "The file name of scan i, without its ending.");
}

}  // namespace
}  // namespace bki_mapping::python

PYBIND11_MODULE(_core, m) {
  using namespace bki_mapping;
  using namespace bki_mapping::python;
  py::register_exception<MapFileError>(m, "MapFileError", PyExc_RuntimeError);
  py::register_exception<ScanRefused>(m, "ScanRefused", PyExc_RuntimeError);
  m.attr("UNKNOWN") = static_cast<int>(VoxelState::kUnknown);
  m.attr("FREE") = static_cast<int>(VoxelState::kFree);
  m.attr("OCCUPIED") = static_cast<int>(VoxelState::kOccupied);
  m.attr("OCCLUDED") = static_cast<int>(VoxelState::kOccluded);
  m.attr("FREE_CLASS") = static_cast<int>(kFreeClass);
  m.attr("EVIDENCE_UNIT") = static_cast<double>(kEvidenceUnit);
  m.attr("RAY_NOTHING") = static_cast<int>(RayEnd::kNothing);
  m.attr("RAY_OCCUPIED") = static_cast<int>(RayEnd::kOccupied);
  m.attr("RAY_UNKNOWN") = static_cast<int>(RayEnd::kUnknown);
  addClasses(m);
  addMap(m);
  addMapper(m);
  addSequence(m);
  addCity(m);
  addJournal(m);
  m.def("merge", &merge, py::arg("inputs"), py::arg("output"), py::arg("keep_drives") = false,
        py::arg("without") = std::vector<std::string>(), py::arg("allow_overlap") = false,
        "Merge map files into another one: the sum of the drives that are in any of them, each counted "
        "once.\n\n"
        "inputs: paths; or (path, translation, yaw) for a map that is turned by yaw [degrees], then moved by "
        "translation [m]; by whole voxels and multiples of 90 degrees this is exact.\n"
        "output: file to write (.bkm); may be one of the inputs.\n"
        "keep_drives: store each drive apart as well.\n"
        "without: ids of drives to be left out.\n"
        "allow_overlap: also add drives that share scans by their ids, such as '04/000000-000009' and "
        "'04/000000-000004'; these scans count twice.\n\n"
        "Returns a dict with drives, repeated, resampled, tiles, blocks and saturated. Raises ValueError if "
        "grids, classes or frames differ, MapFileError if a file cannot be read or written, or a drive "
        "cannot be counted once.");
}
