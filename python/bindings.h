/// @file The parts of the Python module, and what they share: maps, class tables and queries.
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/core/class_table.h"
#include "bki_mapping/query/state_map.h"
#include "bki_mapping/sequence/sequence.h"
#include "bki_mapping/store/mapper_file.h"

namespace bki_mapping::python {

using SharedTable = std::shared_ptr<const ClassTable>;

/// A map that does not change, prepared for queries: a snapshot of a mapper's map, or a map from a file.
struct FixedMap {
  /// @param threads of queries; 0: all cores.
  FixedMap(RuledMap map, int threads) : stored(std::move(map)), states(stored.map, stored.rules, threads) {}

  RuledMap stored;
  StateMap states;
};

using SharedMap = std::shared_ptr<FixedMap>;
using MapClass = pybind11::class_<FixedMap, SharedMap>;

/// Calls job(begin, end) for parts of [0, count), on the threads of the map.
template <typename Job>
void inParts(const StateMap& states, std::size_t count, std::size_t part, Job&& job) {
  states.parallelFor((count + part - 1) / part,
                     [&](std::size_t j) { job(j * part, std::min(count, (j + 1) * part)); });
}

/// @throws pybind11::type_error if the object is no map.
const FixedMap& mapOf(pybind11::handle object, const char* name);
/// The classes that a query is to regard. @param classes None: all; otherwise a ClassFilter of the table, or
/// classes of the table: a name, an id, a SemanticClass, or an iterable of them.
/// @throws std::invalid_argument that names a class that the table lacks, pybind11::type_error.
ClassFilter filterOf(const SharedTable& table, pybind11::handle classes);
/// The ids of classes, in order. @param classes as for filterOf, but no ClassFilter; None: none.
std::vector<ClassId> orderOf(const SharedTable& table, pybind11::handle classes, const char* name);
/// The sensor of poses, by its name. @throws std::invalid_argument if there is none of this name.
std::optional<PosesIn> sensorOf(const std::optional<std::string>& name);

// Each of these adds a part to the module; those that use ClassTable or Map come after them.

/// The classes SemanticClass, ClassTable and ClassFilter.
void addClasses(pybind11::module& m);
/// The classes Map, Block and Drive, with all queries.
void addMap(pybind11::module& m);
/// Queries of Map, on NumPy arrays (docs/queries.md), and the classes Section and DistanceField.
void addQueries(pybind11::module& m, MapClass& map);
/// Queries of points.
void addPoints(MapClass& map);
/// The class DistanceField, and Map.distance_field.
void addDistances(pybind11::module& m, MapClass& map);
/// The class City, open_city() and load().
void addCity(pybind11::module& m);
/// The classes SemanticMapper and ScanStats.
void addMapper(pybind11::module& m);
/// correct() and forget_journal().
void addJournal(pybind11::module& m);

}  // namespace bki_mapping::python
