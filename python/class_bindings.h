/// @file Class tables in Python, and the sets of classes that queries take.
#pragma once

#include <pybind11/pybind11.h>

#include <memory>
#include <vector>

#include "bki_mapping/core/class_table.h"

namespace bki_mapping::python {

using SharedTable = std::shared_ptr<const ClassTable>;

/// The classes that a query is to regard. @param classes None: all; otherwise a ClassFilter of the table, or
/// classes of the table: a name, an id, a SemanticClass, or an iterable of them.
/// @throws std::invalid_argument that names a class that the table lacks, pybind11::type_error.
ClassFilter filterOf(const SharedTable& table, pybind11::handle classes);
/// The ids of classes, in order. @param classes as for filterOf, but no ClassFilter; None: none.
std::vector<ClassId> orderOf(const SharedTable& table, pybind11::handle classes, const char* name);

/// Adds the classes SemanticClass, ClassTable and ClassFilter to the module.
void addClasses(pybind11::module& m);

}  // namespace bki_mapping::python
