/// @file Cities in Python, and maps read from files.
#pragma once

#include <pybind11/pybind11.h>

namespace bki_mapping::python {

/// Adds the class City, open_city() and load() to the module. Map must have been added before.
void addCity(pybind11::module& m);

}  // namespace bki_mapping::python
