#include <algorithm>
#include <limits>
#include <mutex>
#include <string>

#include "arrays.h"
#include "bindings.h"
#include "bki_mapping/query/distance_field.h"

namespace bki_mapping::python {
namespace {

/// A field whose values arrays may show: they share it, and keep it alive.
struct SharedField {
  std::mutex mutex;
  std::shared_ptr<DistanceField> field;
};

/// Calls a function without the GIL, alone with the field.
template <typename Function>
auto alone(SharedField& self, Function&& function) {
  const py::gil_scoped_release release;
  const std::lock_guard<std::mutex> lock(self.mutex);
  return function();
}

std::unique_ptr<SharedField> makeField(const FixedMap& map, py::handle lower, py::handle upper,
                                       py::handle classes, py::handle unknown) {
  const Eigen::AlignedBox3d box(tripleOf(lower, "lower"), tripleOf(upper, "upper"));
  const ObstacleRules rules = {filterOf(map.stored.info.classes, classes), truthOf(unknown, "unknown")};
  auto made = std::make_unique<SharedField>();
  const py::gil_scoped_release release;
  made->field = std::make_shared<DistanceField>(map.states, box, rules);
  return made;
}

py::array values(SharedField& self) {
  using Field = std::shared_ptr<DistanceField>;
  auto kept = alone(self, [&] { return std::make_unique<Field>(self.field); });
  const DistanceField& field = **kept;
  const py::capsule owner(kept.release(), [](void* pointer) { delete static_cast<Field*>(pointer); });
  const Eigen::Vector3i size = field.size();
  return viewOf(owner, field.distances().data(), {size.z(), size.y(), size.x()});
}

py::tuple at(SharedField& self, py::handle object) {
  const Points points(object, "points");
  const auto count = static_cast<py::ssize_t>(points.size());
  py::array_t<float> distances(count), gradients({count, py::ssize_t{3}});
  float *distance = distances.mutable_data(), *gradient = gradients.mutable_data();
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  alone(self, [&] {
    for (std::size_t n = 0; n < points.size(); ++n, gradient += 3) {
      const auto value = self.field->interpolate(points.at(n));
      *distance++ = value ? value->distance : kNone;
      const Eigen::Vector3f slope = value ? value->gradient : Eigen::Vector3f::Constant(kNone).eval();
      std::copy_n(slope.data(), 3, gradient);
    }
  });
  return py::make_tuple(distances, gradients);
}

void compute(SharedField& self, py::handle map, py::handle lower, py::handle upper) {
  const StateMap& states = mapOf(map, "map").states;
  const Eigen::AlignedBox3d box(tripleOf(lower, "lower"), tripleOf(upper, "upper"));
  alone(self, [&] {
    if (self.field.use_count() == 1) {
      self.field->compute(states, box);
    } else {  // arrays show the old values
      DistanceField& old = *self.field;
      if (states.geometry().resolution() != old.resolution()) old.compute(states, box);  // throws
      self.field = std::make_shared<DistanceField>(states, box, old.rules());
    }
  });
}

void update(SharedField& self, py::handle map, py::handle blocks) {
  const StateMap& states = mapOf(map, "map").states;
  const Indices changed(blocks, "blocks");
  alone(self, [&] { self.field->update(states, changed.span()); });
}

Eigen::Vector3d originOf(const DistanceField& field) {
  return Eigen::Vector3d(field.min().x, field.min().y, field.min().z) * field.resolution();
}

std::string description(SharedField& self) {
  const Eigen::Vector3i size = alone(self, [&] { return self.field->size(); });
  return "<bki_mapping.DistanceField of " + std::to_string(size.x()) + " x " + std::to_string(size.y()) +
         " x " + std::to_string(size.z()) + " voxels>";
}

constexpr char kRegionHelp[] =
    "lower, upper: corners of a box, map frame [m], (3,). The field has all voxels that overlap it: at most "
    "100 million, and 16384 along an axis, at 12 bytes per voxel. Obstacles outside the box do not count: "
    "enlarge it by the greatest distance that you need.\n";
constexpr char kFieldHelp[] =
    "The exact signed distance to the nearest obstacle at every voxel of a box, made by Map.distance_field. "
    "It is measured between centres of voxels [m]. In obstacles it is the resolution minus the distance to "
    "the nearest voxel that is no obstacle: 0 in their outermost voxels, negative behind them. It is "
    "infinite if the box has no obstacle, and minus infinity if it has nothing else. Threads may share a "
    "field; their calls wait for each other.";

}  // namespace

void addDistances(py::module& m, MapClass& map) {
  py::class_<SharedField>(m, "DistanceField", kFieldHelp)
      .def_property_readonly(
          "values", &values,
          "The distance at the centre of every voxel [m]: (layers, rows, columns), that is, by z, y, x, "
          "float32. A read-only view; nothing is copied. `update` changes what it shows; `compute` leaves it "
          "as it is.")
      .def_property_readonly(
          "origin",
          [](SharedField& self) {
            const Eigen::Vector3d origin = alone(self, [&] { return originOf(*self.field); });
            return py::array_t<double>(3, origin.data());
          },
          "The lower corner of the first voxel, which has the smallest coordinates, map frame [m]: (3,), "
          "float64.")
      .def_property_readonly(
          "resolution",
          [](SharedField& self) { return alone(self, [&] { return self.field->resolution(); }); },
          "Edge of a voxel [m].")
      .def("at", &at, py::arg("points"),
           "The distance at points, interpolated between the eight voxels about each, and its gradient, "
           "which points away from obstacles.\n\npoints: map frame [m], (N, 3).\n\nReturns distances [m], "
           "(N,), and gradients [m/m], (N, 3), float32; NaN for points outside of the box or not finite. "
           "Where one of the eight is infinite, so is the distance, and the gradient is 0.")
      .def("update", &update, py::arg("map"), py::arg("blocks"),
           "Bring the field up to date with a newer map. The result equals a new field to the bit, and takes "
           "less time if few blocks have changed.\n\nmap: a Map of the same resolution.\nblocks: indices of "
           "the blocks that may have changed since, (N, 3), such as SemanticMapper.touched_blocks of each "
           "scan; "
           "those outside of the box are ignored.\n\nRaises ValueError if the resolution differs.")
      .def("compute", &compute, py::arg("map"), py::arg("lower"), py::arg("upper"),
           (std::string("Compute the field of another box, for example one that moves with the robot. This "
                        "reuses the field's memory, and so saves much of the time of a new field, unless "
                        "you still hold an array of `values`.\n\n") +
            kRegionHelp + "\nRaises ValueError like Map.distance_field; the field is then unchanged.")
               .c_str())
      .def("__repr__", &description);
  map.def("distance_field", &makeField, py::arg("lower"), py::arg("upper"), py::arg("classes") = py::none(),
          py::arg("unknown") = false,
          (std::string("The distance to the nearest obstacle at every voxel of a box, as a "
                       "DistanceField.\n\n") +
           kRegionHelp +
           "classes: those that are obstacles: None (all), a name, an id, a list of them, or a ClassFilter "
           "such as street.classes.all_but('road').\n"
           "unknown: whether unknown and occluded voxels are obstacles as well.\n\n"
           "Raises ValueError if the box is not finite, inside out, too large or beyond the grid, or a class "
           "is unknown; MemoryError if there is not enough memory.")
              .c_str());
}

}  // namespace bki_mapping::python
