/// @file Corrected poses of map files in Python.
#pragma once

#include <pybind11/pybind11.h>

#include <optional>
#include <string>

#include "bki_mapping/sequence/sequence.h"

namespace bki_mapping::python {

/// The sensor of poses, by its name. @throws std::invalid_argument if there is none of this name.
std::optional<PosesIn> sensorOf(const std::optional<std::string>& name);

/// Adds correct() and forget_journal() to the module.
void addJournal(pybind11::module& m);

}  // namespace bki_mapping::python
