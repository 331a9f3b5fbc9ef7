/// @file The mapper in Python.
#pragma once

#include <pybind11/pybind11.h>

namespace bki_mapping::python {

/// Adds the classes SemanticMapper and ScanStats to the module. Map must have been added before.
void addMapper(pybind11::module& m);

}  // namespace bki_mapping::python
