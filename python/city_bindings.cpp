#include <pybind11/stl.h>

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "bki_mapping/city/tiled_map.h"

namespace bki_mapping::python {
namespace {

constexpr std::size_t kMegabyte = 1'000'000;
constexpr std::size_t kUsualMegabytes = TiledMap::kUsualLimit / kMegabyte;

/// A city that threads share: their calls wait for each other.
struct City {
  explicit City(const std::string& path) : map(path) {}

  TiledMap map;
  std::mutex mutex;
};

/// Calls work() without the GIL, and while no other thread reads the city.
template <typename Work>
auto alone(City& city, Work&& work) {
  const py::gil_scoped_release release;
  const std::lock_guard<std::mutex> lock(city.mutex);
  return work();
}

/// A number of threads; StateMap checks its range.
int threadsOf(py::handle threads) {
  const std::size_t count = countOf(threads, "threads");
  return static_cast<int>(std::min<std::size_t>(count, std::numeric_limits<int>::max()));
}

std::size_t limitOf(py::handle megabytes) {
  const std::size_t count = countOf(megabytes, "memory_limit");
  return kMegabyte * std::min(count, std::numeric_limits<std::size_t>::max() / kMegabyte);
}

/// Two opposite corners; None is all of space.
Eigen::AlignedBox3d boxOf(py::handle box) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (box.is_none()) return {Eigen::Vector3d::Constant(-kInfinity), Eigen::Vector3d::Constant(kInfinity)};
  const std::string wrong = "box must be two corners, ((x, y, z), (x, y, z)), not " + typeName(box);
  if (PySequence_Check(box.ptr()) == 0 || py::isinstance<py::str>(box)) throw py::type_error(wrong);
  const auto corners = py::reinterpret_borrow<py::sequence>(box);
  if (corners.size() != 2) throw std::invalid_argument("box must be two corners, ((x, y, z), (x, y, z))");
  const Eigen::Vector3d a = vectorOf(py::object(corners[0]), "a corner of box");
  const Eigen::Vector3d b = vectorOf(py::object(corners[1]), "a corner of box");
  return {a.cwiseMin(b), a.cwiseMax(b)};
}

SharedMap load(py::handle path, py::handle threads, py::handle box, py::handle memory_limit) {
  const std::string file = pathOf(path, "path");
  const int count = threadsOf(threads);
  const Eigen::AlignedBox3d asked = boxOf(box);
  const std::size_t limit = limitOf(memory_limit);
  const py::gil_scoped_release release;
  return std::make_shared<FixedMap>(TiledMap(file).readBox(asked, limit), count);
}

std::unique_ptr<City> openCity(py::handle path) {
  const std::string folder = pathOf(path, "path");
  auto city = [&] {
    const py::gil_scoped_release release;
    return std::make_unique<City>(folder);
  }();
  if (!city->map.isCity()) throw std::invalid_argument(folder + " is a map file, not a city; call load()");
  return city;
}

SharedMap loadBox(City& city, py::handle box, py::handle threads, py::handle memory_limit) {
  const int count = threadsOf(threads);
  const Eigen::AlignedBox3d asked = boxOf(box);
  const std::size_t limit = limitOf(memory_limit);
  return alone(city, [&] { return std::make_shared<FixedMap>(city.map.readBox(asked, limit), count); });
}

SharedMap loadAt(City& city, py::handle points, py::handle threads, py::handle memory_limit) {
  const int count = threadsOf(threads);
  const Points given(points, "points");
  const std::size_t limit = limitOf(memory_limit);
  return alone(city, [&] {
    std::vector<Eigen::Vector3d> at(given.size());
    for (std::size_t n = 0; n < at.size(); ++n) at[n] = given.at(n);
    return std::make_shared<FixedMap>(city.map.readTilesAt(at, limit), count);
  });
}

py::array regionsOf(City& city) {
  using R = CityRegion;
  return ownedArray(city.map.regions(), structType({{"x", "i4", offsetof(R, x)},
                                                    {"y", "i4", offsetof(R, y)},
                                                    {"tiles", "u8", offsetof(R, tiles)},
                                                    {"blocks", "u8", offsetof(R, blocks)},
                                                    {"bytes", "u8", offsetof(R, bytes)}},
                                                   sizeof(R)));
}

py::object boundsOf(City& city) {
  Eigen::AlignedBox3d box;
  for (const CityRegion& region : city.map.regions()) box.extend(region.bounds);
  return cornersOf(box);
}

}  // namespace

void addCity(py::module& m) {
  py::class_<City>(
      m, "City",
      "A city on the disk, as map_city writes it; open_city() opens one. It reads only the tiles "
      "that are asked for, and what it reads equals, to the bit, the same part of the whole map.")
      .def_property_readonly(
          "path", [](City& city) { return city.map.path(); }, "The folder.")
      .def_property_readonly(
          "resolution", [](City& city) { return alone(city, [&] { return city.map.resolution(); }); },
          "Edge of a voxel [m].")
      .def_property_readonly(
          "frame", [](City& city) { return alone(city, [&] { return city.map.info().frame; }); },
          "Name of the map frame.")
      .def_property_readonly(
          "classes",
          [](City& city) {
            return std::const_pointer_cast<ClassTable>(alone(city, [&] { return city.map.info().classes; }));
          },
          "The class table.")
      .def_property_readonly(
          "drives", [](City& city) { return city.map.driveNames(); }, "The names of the drives.")
      .def_property_readonly(
          "tiles", [](City& city) { return city.map.tileCount(); }, "Number of tiles.")
      .def_property_readonly(
          "regions", &regionsOf,
          "The regions, each in a file: structured, with the index x, y, and the number of "
          "tiles, blocks and bytes.")
      .def_property_readonly("bounds", &boundsOf,
                             "The box of all voxels that are free, occupied or occluded: its lower and its "
                             "upper corner [m], (2, 3), float64. None if there is none.")
      .def_property_readonly(
          "tiles_read", [](City& city) { return alone(city, [&] { return city.map.reading().tiles; }); },
          "How many tiles have been read so far.")
      .def_property_readonly(
          "files_read", [](City& city) { return alone(city, [&] { return city.map.reading().files; }); },
          "How many files of regions have been opened so far.")
      .def(
          "load", &loadBox, py::arg("box") = py::none(), py::arg("threads") = 0,
          py::arg("memory_limit") = kUsualMegabytes,
          "Read the voxels whose centres lie in a box; all others are unknown.\n\nbox: two opposite corners, "
          "map frame [m], which may be infinite; None: everything.\nthreads: that queries of many things "
          "use; 0: all cores.\nmemory_limit: refuse to read more than this [MB]; 0: no limit.\n\nRaises "
          "MapFileError if a file cannot be read or does not fit the index, or beyond the limit.")
      .def("load_at", &loadAt, py::arg("points"), py::arg("threads") = 0,
           py::arg("memory_limit") = kUsualMegabytes,
           "Read the tiles, cubes of 64 voxels, that contain some points, map frame [m]: (N, 3). All other "
           "tiles are unknown. Arguments and errors are those of load().");
  m.def("open_city", &openCity, py::arg("path"),
        "Open the folder of a city. Reads its index.\n\nRaises MapFileError if the folder has no index, or a "
        "damaged one; ValueError if it is a map file.");
  m.def(
      "load", &load, py::arg("path"), py::arg("threads") = 0, py::arg("box") = py::none(),
      py::arg("memory_limit") = kUsualMegabytes,
      "Read a map file (.bkm) or the folder of a city.\n\nthreads: that queries of many things use; 0: all "
      "cores.\nbox: read only the voxels whose centres lie in it: two opposite corners, map frame [m], which "
      "may be infinite.\nmemory_limit: refuse to read more than this [MB]; 0: no limit.\n\nRaises "
      "MapFileError if it cannot be read, is damaged, is no map, or takes more than the limit.");
}

}  // namespace bki_mapping::python
