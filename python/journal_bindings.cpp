#include <pybind11/stl.h>

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "journal/corrected_file.h"
#include "journal/scan_poses.h"

namespace bki_mapping::python {
namespace {

using Poses = std::vector<Eigen::Isometry3d>;
using Wanted = std::function<Poses(const std::vector<ScanRecord>&)>;

/// Poses of a file, as correct_map takes them.
Wanted ofFile(const std::string& path, py::handle calib, const std::optional<std::string>& poses_in) {
  const std::string beside = (std::filesystem::path(path).parent_path() / "calib.txt").string();
  const LidarPoses poses =
      readLidarPoses(path, calib.is_none() ? beside : pathOf(calib, "calib"), sensorOf(poses_in));
  return [=](const std::vector<ScanRecord>& scans) { return wantedPoses(scans, poses, path); };
}

/// Poses of an array. @param stamps of the poses, or None: one for each scan.
Wanted ofArray(py::handle object, py::handle stamps) {
  const Poses poses = posesOf(object, "poses");
  for (std::size_t n = 0; n < poses.size(); ++n) {
    if (isPose(poses[n].matrix())) continue;
    throw std::invalid_argument("poses[" + std::to_string(n) + "] must be a rotation and a translation");
  }
  LidarPoses of_scans;
  of_scans.poses = poses;
  if (stamps.is_none()) {
    return [=](const std::vector<ScanRecord>& scans) { return wantedPoses(scans, of_scans, "poses"); };
  }
  std::vector<StampedMotion> keyframes;
  for (const py::handle stamp : py::iter(stamps)) {
    const Eigen::Isometry3d pose = keyframes.size() < poses.size() ? poses[keyframes.size()] : poses.back();
    keyframes.push_back({stampOf(stamp), pose});
  }
  if (keyframes.size() != poses.size()) {
    throw std::invalid_argument("there are " + std::to_string(poses.size()) + " poses, but " +
                                std::to_string(keyframes.size()) + " stamps; give each pose one stamp");
  }
  return [=](const std::vector<ScanRecord>& scans) { return wantedPoses(scans, keyframes, "poses"); };
}

bool isPath(py::handle object) {
  return py::isinstance<py::str>(object) || py::isinstance<py::bytes>(object) ||
         py::hasattr(object, "__fspath__");
}

py::dict correct(py::handle path, py::handle poses, py::handle stamps,
                 const std::optional<std::string>& drive, py::handle tolerance, py::handle output,
                 const std::optional<std::string>& poses_in, py::handle calib) {
  CorrectionOrder order;
  const std::string file = pathOf(path, "path");
  if (drive && drive->empty()) throw std::invalid_argument("drive is empty; give the id of a drive, or None");
  order.drive = drive.value_or("");
  order.tolerance = numberOf(tolerance, "tolerance");
  if (!(order.tolerance >= 0.0)) throw std::invalid_argument("tolerance must be 0 or more");
  if (!output.is_none()) order.output = pathOf(output, "output");
  if (isPath(poses) && !stamps.is_none()) {
    throw std::invalid_argument("stamps are for an array of poses; a file has its own");
  }
  if (!isPath(poses) && (poses_in || !calib.is_none())) {
    throw std::invalid_argument(
        "poses_in and calib are for a file of poses; an array has poses of the sensor");
  }
  order.wanted = isPath(poses) ? ofFile(pathOf(poses, "poses"), calib, poses_in) : ofArray(poses, stamps);
  CorrectedFile corrected;
  {
    const py::gil_scoped_release release;
    corrected = correctMapFile(file, order);
  }
  if (!corrected.warning.empty()) warn(corrected.warning);
  py::dict result;
  result["drive"] = corrected.drive;
  result["scans"] = corrected.scans;
  result["moved"] = corrected.moved;
  result["largest_move"] = corrected.largest_move;
  result["tiles"] = corrected.tiles;
  return result;
}

py::dict forgetJournal(py::handle path, py::handle output) {
  const std::string file = pathOf(path, "path");
  const std::string to = output.is_none() ? "" : pathOf(output, "output");
  ForgottenScans forgotten;
  {
    const py::gil_scoped_release release;
    forgotten = forgetJournalOfFile(file, to);
  }
  py::dict result;
  result["scans"] = forgotten.scans;
  result["bytes"] = forgotten.bytes;
  return result;
}

}  // namespace

std::optional<PosesIn> sensorOf(const std::optional<std::string>& name) {
  if (!name) return std::nullopt;
  if (*name == "camera") return PosesIn::kCamera;
  if (*name == "lidar") return PosesIn::kLidar;
  throw std::invalid_argument("poses_in is '" + *name + "', but must be 'camera' or 'lidar'");
}

void addJournal(py::module& m) {
  m.def(
      "correct", &correct, py::arg("path"), py::arg("poses"), py::arg("stamps") = py::none(),
      py::arg("drive") = py::none(), py::arg("tolerance") = 0.0, py::arg("output") = py::none(),
      py::arg("poses_in") = py::none(), py::arg("calib") = py::none(),
      "Move the scans in the journal of a map file to corrected poses: the map is then, to the bit, the one "
      "that these poses would have made.\n\n"
      "poses: T_map_sensor, (N, 4, 4), one for each scan of the drive, in order; or a file of poses, as "
      "correct_map takes it.\n"
      "stamps: of the poses of an array [ns], (N,), on the clock of the scans; then not every scan needs a "
      "pose, and scans in between keep the shape of their recorded way.\n"
      "drive: id of the drive whose scans move; needed if the journal has several.\n"
      "tolerance: scans stay if no point is farther than this from where it belongs [m].\n"
      "output: file for the result (.bkm). None: the file itself is changed, completely or not at all.\n"
      "poses_in: which sensor the poses of a file are of, 'camera' or 'lidar'; None: the camera, and the "
      "lidar if they have stamps.\n"
      "calib: file with the transform from the lidar to the camera. None: the calib.txt beside the poses.\n\n"
      "Returns a dict with drive, scans (of the drive, in the journal), moved, largest_move [m] and tiles "
      "(changed). Raises ValueError if poses, stamps or the drive do not fit, RuntimeError if the file of "
      "poses cannot be read, MapFileError if a map file cannot be read or written, or has no journal.");
  m.def("forget_journal", &forgetJournal, py::arg("path"), py::arg("output") = py::none(),
        "Drop the scans that a map file keeps in its journal. The map stays, and they cannot be moved any "
        "more.\n\n"
        "output: file for the result (.bkm). None: the file itself is changed, and does not shrink.\n\n"
        "Returns a dict with scans and bytes. Raises ValueError for another ending, MapFileError if a file "
        "cannot be read or written.");
}

}  // namespace bki_mapping::python
