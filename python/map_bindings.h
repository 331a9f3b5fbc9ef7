/// @file The map in Python: a snapshot of a mapper's map, or a map from a file. It does not change.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>

#include "bki_mapping/store/map_file.h"

namespace bki_mapping::python {

using SharedMap = std::shared_ptr<StoredMap>;

/// Adds the classes Map, Block, Drive, SemanticClass and ClassTable to the module.
void addMap(pybind11::module& m);

}  // namespace bki_mapping::python
