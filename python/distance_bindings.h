/// @file Distance fields in Python.
#pragma once

#include "map_bindings.h"

namespace bki_mapping::python {

/// Adds the class DistanceField to the module, and Map.distance_field.
void addDistances(pybind11::module& m, MapClass& map);

}  // namespace bki_mapping::python
