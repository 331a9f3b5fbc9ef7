/// @file Queries of points in Python.
#pragma once

#include "map_bindings.h"

namespace bki_mapping::python {

/// Adds the queries of points to the class Map.
void addPoints(MapClass& map);

}  // namespace bki_mapping::python
