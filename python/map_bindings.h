/// @file The map in Python: a snapshot of a mapper's map, or a map from a file. It does not change.
#pragma once

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>

#include "bki_mapping/query/state_map.h"
#include "bki_mapping/store/mapper_file.h"

namespace bki_mapping::python {

/// A map that does not change, prepared for queries.
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

/// Adds the classes Map, Block and Drive to the module. ClassTable must have been added before.
void addMap(pybind11::module& m);

}  // namespace bki_mapping::python
