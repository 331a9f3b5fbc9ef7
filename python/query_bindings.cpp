#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "arrays.h"
#include "bindings.h"
#include "bki_mapping/query/queries.h"

namespace bki_mapping::python {
namespace {

/// Rays from arrays. @param origins one for all directions, or one for each.
std::vector<Ray> raysOf(const StateMap& states, py::handle origins, py::handle directions,
                        py::handle max_length) {
  const Points ways(directions, "directions");
  const py::array array =
      arrayOf(origins, "origins", "an array of numbers of shape (N, 3), or three numbers");
  const bool one_origin = array.ndim() == 1;
  const Points from = one_origin ? ways : Points(origins, "origins");
  const Eigen::Vector3d origin = one_origin ? tripleOf(origins, "origins") : Eigen::Vector3d();
  if (!one_origin && from.size() != ways.size()) {
    throw std::invalid_argument("there are " + std::to_string(from.size()) + " origins and " +
                                std::to_string(ways.size()) +
                                " directions; give one origin, or as many as directions");
  }
  const Numbers lengths(max_length, "max_length", ways.size(), "rays");
  const py::gil_scoped_release release;
  std::vector<Ray> rays(ways.size());
  constexpr std::size_t kPart = 4096;
  inParts(states, rays.size(), kPart, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      rays[n] = {one_origin ? origin : from.at(n), ways.at(n), lengths.at(n)};
    }
  });
  return rays;
}

py::array castAll(const FixedMap& map, py::handle origins, py::handle directions, py::handle max_length,
                  py::handle classes, py::handle stop_at_unknown) {
  const RayStops stops = {filterOf(map.stored.info.classes, classes),
                          truthOf(stop_at_unknown, "stop_at_unknown")};
  const std::vector<Ray> rays = raysOf(map.states, origins, directions, max_length);
  std::vector<RayHit> hits;
  {
    const py::gil_scoped_release release;
    hits.resize(rays.size());
    castRays(map.states, rays, stops, hits);
  }
  using H = RayHit;
  return ownedArray(std::move(hits), structType({{"end", "u1", offsetof(H, end)},
                                                 {"label", "u1", offsetof(H, label)},
                                                 {"voxel", "i4", offsetof(H, voxel), 3},
                                                 {"length", "f8", offsetof(H, length)},
                                                 {"first_unknown", "f8", offsetof(H, first_unknown)}},
                                                sizeof(H)));
}

/// A SpaceContent, for a structured array.
struct ContentRecord {
  std::int64_t free, occupied, unknown;
  bool is_free, is_known;
  ClassId worst;
  std::array<bool, 256> classes;
};

/// @param read called as read(contents) without the GIL, fills in the contents of `count` shapes.
template <typename Read>
py::array contentsAs(const FixedMap& map, std::size_t count, py::handle order, Read&& read) {
  const std::vector<ClassId> worst_first = orderOf(map.stored.info.classes, order, "order");
  std::vector<ContentRecord> records;
  {
    const py::gil_scoped_release release;
    std::vector<SpaceContent> contents(count);
    read(Span<SpaceContent>(contents));
    records.reserve(count);
    for (const SpaceContent& content : contents) {
      const auto signedOf = [](std::size_t voxels) { return static_cast<std::int64_t>(voxels); };
      records.push_back({signedOf(content.free),
                         signedOf(content.occupied),
                         signedOf(content.unknown),
                         content.isFree(),
                         content.isKnown(),
                         content.worst(worst_first).value_or(kFreeClass),
                         {}});
      for (const ClassId id : content.classes.ids()) records.back().classes[id] = true;
    }
  }
  using C = ContentRecord;
  return ownedArray(std::move(records), structType({{"free", "i8", offsetof(C, free)},
                                                    {"occupied", "i8", offsetof(C, occupied)},
                                                    {"unknown", "i8", offsetof(C, unknown)},
                                                    {"is_free", "?", offsetof(C, is_free)},
                                                    {"is_known", "?", offsetof(C, is_known)},
                                                    {"worst", "u1", offsetof(C, worst)},
                                                    {"classes", "?", offsetof(C, classes), 256}},
                                                   sizeof(C)));
}

py::array boxContents(const FixedMap& map, py::handle lower, py::handle upper, py::handle order) {
  const DoublePoints low(lower, "lower"), high(upper, "upper");
  if (low.size() != high.size()) {
    throw std::invalid_argument("there are " + std::to_string(low.size()) + " lower and " +
                                std::to_string(high.size()) + " upper corners; give as many");
  }
  return contentsAs(map, low.size(), order, [&](Span<SpaceContent> contents) {
    std::vector<Eigen::AlignedBox3d> boxes;
    boxes.reserve(low.size());
    for (std::size_t n = 0; n < low.size(); ++n) boxes.emplace_back(low.span()[n], high.span()[n]);
    contentsOf(map.states, boxes, contents);
  });
}

py::array sphereContents(const FixedMap& map, py::handle centres, py::handle radii, py::handle order) {
  const Points middles(centres, "centres");
  const Numbers sizes(radii, "radii", middles.size(), "spheres");
  return contentsAs(map, middles.size(), order, [&](Span<SpaceContent> contents) {
    std::vector<Sphere> spheres;
    spheres.reserve(middles.size());
    for (std::size_t n = 0; n < middles.size(); ++n) spheres.push_back({middles.at(n), sizes.at(n)});
    contentsOf(map.states, spheres, contents);
  });
}

py::array pathContents(const FixedMap& map, py::handle poses, py::handle half_extents, py::handle centre,
                       py::handle order) {
  const std::vector<Eigen::Isometry3d> path = posesOf(poses, "poses");
  OrientedBox box = {Eigen::Isometry3d::Identity(), tripleOf(half_extents, "half_extents")};
  box.T_map_box.translation() = tripleOf(centre, "centre");
  return contentsAs(map, path.size(), order,
                    [&](Span<SpaceContent> contents) { contentsAlong(map.states, box, path, contents); });
}

/// A NearestObstacle, for a structured array.
struct NearestRecord {
  double distance;
  std::array<std::int32_t, 3> voxel;
  ClassId label;
};

py::array nearest(const FixedMap& map, py::handle object, py::handle classes, py::handle max_distance) {
  const DoublePoints points(object, "points");
  const ClassFilter filter = filterOf(map.stored.info.classes, classes);
  const double most = numberOf(max_distance, "max_distance");
  std::vector<NearestRecord> records;
  {
    const py::gil_scoped_release release;
    std::vector<std::optional<NearestObstacle>> found(points.size());
    nearestObstacles(map.states, points.span(), filter, most, found);
    records.reserve(found.size());
    for (const auto& each : found) {
      records.push_back({std::numeric_limits<double>::infinity(), {0, 0, 0}, kFreeClass});
      if (each) records.back() = {each->distance, {each->voxel.x, each->voxel.y, each->voxel.z}, each->label};
    }
  }
  using N = NearestRecord;
  return ownedArray(std::move(records), structType({{"distance", "f8", offsetof(N, distance)},
                                                    {"voxel", "i4", offsetof(N, voxel), 3},
                                                    {"label", "u1", offsetof(N, label)}},
                                                   sizeof(N)));
}

Section horizontal(const FixedMap& map, py::handle z, py::handle lower, py::handle upper) {
  const double height = numberOf(z, "z");
  const Eigen::AlignedBox2d area(pairOf(lower, "lower"), pairOf(upper, "upper"));
  const py::gil_scoped_release release;
  return horizontalSection(map.states, height, area);
}

Section vertical(const FixedMap& map, py::handle start, py::handle end, py::handle min_z, py::handle max_z) {
  const Eigen::Vector2d from = pairOf(start, "start"), to = pairOf(end, "end");
  const double low = numberOf(min_z, "min_z"), high = numberOf(max_z, "max_z");
  const py::gil_scoped_release release;
  return verticalSection(map.states, from, to, low, high);
}

std::vector<py::ssize_t> shapeOf(const Section& section) {
  return {static_cast<py::ssize_t>(section.height), static_cast<py::ssize_t>(section.width)};
}

py::array_t<double> centresOf(const Section& section) {
  std::vector<py::ssize_t> shape = shapeOf(section);
  shape.push_back(3);
  py::array_t<double> centres(shape);
  double* to = centres.mutable_data();
  for (std::size_t row = 0; row < section.height; ++row) {
    for (std::size_t column = 0; column < section.width; ++column, to += 3) {
      const Eigen::Vector3d centre = section.centreOf(column, row);
      std::copy_n(centre.data(), 3, to);
    }
  }
  return centres;
}

void addSection(py::module& m) {
  const auto vectorAt = [](Eigen::Vector3d Section::*member) {
    return [member](const Section& s) { return py::array_t<double>(3, (s.*member).data()); };
  };
  py::class_<Section>(m, "Section",
                      "A horizontal or vertical grid of square cells through the map, with its resolution. A "
                      "cell has the state and label of the voxel at its centre.")
      .def_property_readonly(
          "states",
          [](const py::object& self) {
            const auto& s = py::cast<const Section&>(self);
            return viewOf(self, reinterpret_cast<const std::uint8_t*>(s.states.data()), shapeOf(s));
          },
          "UNKNOWN, FREE, OCCUPIED or OCCLUDED of each cell: (rows, columns), uint8. A read-only view.")
      .def_property_readonly(
          "labels",
          [](const py::object& self) {
            const auto& s = py::cast<const Section&>(self);
            return viewOf(self, s.labels.data(), shapeOf(s));
          },
          "The class id of each occupied cell; FREE_CLASS elsewhere: (rows, columns), uint8. A read-only "
          "view.")
      .def_property_readonly("origin", vectorAt(&Section::origin),
                             "The corner of cell [0, 0], map frame [m]: (3,), float64.")
      .def_property_readonly("right", vectorAt(&Section::right),
                             "Unit vector in the direction of increasing columns, map frame: (3,), float64.")
      .def_property_readonly("up", vectorAt(&Section::up),
                             "Unit vector in the direction of increasing rows, map frame: (3,), float64.")
      .def_readonly("resolution", &Section::resolution, "Edge of a cell [m].")
      .def_property_readonly("centres", &centresOf,
                             "The centre of each cell, map frame [m]: (rows, columns, 3), float64. Computed "
                             "at each call.")
      .def("__repr__", [](const Section& s) {
        return "<bki_mapping.Section of " + std::to_string(s.height) + " rows and " +
               std::to_string(s.width) + " columns>";
      });
}

/// A Frontier, for a structured array.
struct FrontierRecord {
  std::array<double, 3> centre;
  std::int64_t size;
};

py::object frontiersOf(const FixedMap& map, py::handle min_size, py::handle return_voxels, py::handle lower,
                       py::handle upper) {
  FrontierRules rules;
  rules.min_size = countOf(min_size, "min_size");
  rules.with_voxels = truthOf(return_voxels, "return_voxels");
  if (lower.is_none() != upper.is_none()) {
    throw std::invalid_argument("the box has only one corner; give lower and upper, or neither");
  }
  if (!lower.is_none()) rules.box.emplace(tripleOf(lower, "lower"), tripleOf(upper, "upper"));
  std::vector<FrontierRecord> records;
  std::vector<GridIndex> voxels;
  {
    const py::gil_scoped_release release;
    for (const Frontier& each : frontiers(map.states, rules)) {
      const Eigen::Vector3d& centre = each.centre;
      records.push_back({{centre.x(), centre.y(), centre.z()}, static_cast<std::int64_t>(each.size)});
      voxels.insert(voxels.end(), each.voxels.begin(), each.voxels.end());
    }
  }
  using F = FrontierRecord;
  py::array found = ownedArray(
      std::move(records),
      structType({{"centre", "f8", offsetof(F, centre), 3}, {"size", "i8", offsetof(F, size)}}, sizeof(F)));
  if (!rules.with_voxels) return py::object(std::move(found));
  return py::make_tuple(found, indexArray(voxels));
}

}  // namespace

void addQueries(py::module& m, MapClass& map) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const py::arg_v classes = py::arg("classes") = py::none(), order = py::arg("order") = py::none();
  addSection(m);
  addPoints(map);
  map.def(
      "cast_rays", &castAll, py::arg("origins"), py::arg("directions"), py::arg("max_length") = kInfinity,
      classes, py::arg("stop_at_unknown") = false,
      "Follow rays through the map, to the first occupied voxel.\n\n"
      "origins: map frame [m], (N, 3), or one for all rays, (3,).\n"
      "directions: in the map frame, of any length above 0, (N, 3).\n"
      "max_length: maximum length of the rays [m], 0 or more; a number, or one for each. Infinite rays end "
      "where the map does.\n"
      "classes: those at which rays stop; they pass through all others. None (all), a name, an id, a list of "
      "them, or a ClassFilter.\n"
      "stop_at_unknown: whether rays also stop at unknown and occluded voxels.\n\n"
      "Returns (N,), structured: end (RAY_NOTHING, RAY_OCCUPIED or RAY_UNKNOWN), label (the class id if "
      "occupied, else FREE_CLASS), voxel (the index of the voxel at which it stopped, if it did), length "
      "(to where it enters that voxel, or its whole length [m]) and first_unknown (to the first unknown "
      "or occluded voxel before it stops [m]; infinite without one).\n\n"
      "Raises ValueError if a coordinate is not finite, a direction is 0, a length is negative or NaN, an "
      "origin lies beyond the grid, or a class is unknown.");
  constexpr char kContentHelp[] =
      "order: classes from the worst to the least bad, for the field worst.\n\n"
      "Returns (N,), structured, of the voxels that each shape overlaps: free, occupied and unknown (numbers "
      "of voxels; occluded ones are among the unknown), is_free (nothing occupied or unknown), is_known "
      "(nothing unknown), worst (the id of the first class of `order` that is present; FREE_CLASS without "
      "one) and classes (whether each class id is present, (256,), bool).\n\n"
      "Raises ValueError if a shape is not finite, inside out or empty, reaches beyond the grid, or spans "
      "more than 100 million voxels, or a class is unknown.";
  const auto content = [&](const char* text) { return std::string(text) + kContentHelp; };
  map.def("box_contents", &boxContents, py::arg("lower"), py::arg("upper"), order,
          content("Count the voxels in boxes along the axes of the map frame, by state, and find their "
                  "classes.\n\n"
                  "lower, upper: corners, map frame [m], (N, 3) each.\n")
              .c_str())
      .def("sphere_contents", &sphereContents, py::arg("centres"), py::arg("radii"), order,
           content("Count the voxels in spheres, by state, and find their classes.\n\n"
                   "centres: map frame [m], (N, 3).\n"
                   "radii: above 0 [m]; a number, or one for each.\n")
               .c_str())
      .def("contents_along", &pathContents, py::arg("poses"), py::arg("half_extents"),
           py::arg("centre") = py::make_tuple(0.0, 0.0, 0.0), order,
           content("Count the voxels in the box of a vehicle at each pose of a path, or in boxes of any "
                   "orientation, by state, and find their classes. What it sweeps between two poses is not "
                   "checked: give poses a voxel or two apart.\n\n"
                   "poses: T_map_vehicle, rotation and translation [m], (N, 4, 4).\n"
                   "half_extents: half the length, width and height of the box [m], (3,), above 0.\n"
                   "centre: of the box, in the vehicle's frame [m], (3,).\n")
               .c_str())
      .def("nearest_obstacles", &nearest, py::arg("points"), classes, py::arg("max_distance") = kInfinity,
           "Find the occupied voxel whose centre is nearest to each point. Exact; for many points close "
           "together, a distance field is faster.\n\n"
           "points: map frame [m], (N, 3).\n"
           "classes: those that are obstacles: None (all), a name, an id, a list of them, or a ClassFilter.\n"
           "max_distance: greatest distance to the centre [m], 0 or more.\n\n"
           "Returns (N,), structured: distance (from the point to the centre [m]; infinite if there is none "
           "within max_distance), voxel (its index; its centre is (voxel + 0.5) * resolution) and label (its "
           "class id; FREE_CLASS if there is none).\n\n"
           "Raises ValueError if a point is not finite or beyond the grid, max_distance is negative or NaN, "
           "or a class is unknown.")
      .def("horizontal_section", &horizontal, py::arg("z"), py::arg("lower"), py::arg("upper"),
           "The layer of voxels at a height, as a Section.\n\n"
           "z: height in the map frame [m].\n"
           "lower, upper: corners of the area, x and y in the map frame [m], (2,); the section has all "
           "voxels that overlap it, at most 100 million.\n\n"
           "Raises ValueError if a number is not finite, the area is inside out, or the section is too large "
           "or reaches beyond the grid.")
      .def("vertical_section", &vertical, py::arg("start"), py::arg("end"), py::arg("min_z"),
           py::arg("max_z"),
           "The vertical plane through two points, seen with `start` on the left, as a Section.\n\n"
           "start, end: x and y in the map frame [m], (2,); must differ.\n"
           "min_z, max_z: heights in the map frame [m]; the section has all layers of voxels between them, "
           "at most 100 million cells.\n\n"
           "Raises ValueError like horizontal_section.")
      .def("frontiers", &frontiersOf, py::arg("min_size") = 1, py::arg("return_voxels") = false,
           py::arg("lower") = py::none(), py::arg("upper") = py::none(),
           "Where known free space ends: clusters of free voxels with an unknown or occluded one on at least "
           "one of six sides. Those that share a face, an edge or a corner form one cluster. The largest "
           "comes first.\n\n"
           "min_size: least number of voxels; smaller frontiers are left out.\n"
           "return_voxels: whether to return the indices of their voxels as well.\n"
           "lower, upper: corners of a box, map frame [m], (3,): only voxels that it overlaps count, as if "
           "there "
           "were no other frontier voxels. None: the whole map.\n\n"
           "Returns (N,), structured: centre (mean of the centres of its voxels, map frame [m], (3,)) and "
           "size (number of voxels); with return_voxels, also the voxels of all frontiers one after the "
           "other, "
           "(sum of sizes, 3), int32.\n\nRaises ValueError if min_size is negative, or the box is not "
           "finite, inside out, or "
           "reaches beyond the grid.");
  addDistances(m, map);
}

}  // namespace bki_mapping::python
