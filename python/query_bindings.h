/// @file Queries of a map in Python: docs/queries.md, on NumPy arrays.
#pragma once

#include "map_bindings.h"

namespace bki_mapping::python {

/// Adds queries to the class Map, and the classes Section and DistanceField to the module.
void addQueries(pybind11::module& m, MapClass& map);

}  // namespace bki_mapping::python
