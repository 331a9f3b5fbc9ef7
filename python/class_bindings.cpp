#include <pybind11/stl.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "arrays.h"
#include "bindings.h"
#include "bki_mapping/settings/yaml.h"

namespace bki_mapping::python {
namespace {

/// A set of classes, and the table whose ids they are.
struct TableFilter {
  SharedTable table;
  ClassFilter filter;

  std::vector<const SemanticClass*> classes() const {
    std::vector<const SemanticClass*> in;
    for (const SemanticClass& each : table->classes()) {
      if (filter.contains(each.id)) in.push_back(&each);
    }
    return in;
  }
};

std::vector<std::string> flagsOf(const SemanticClass& c) {
  std::vector<std::string> flags;
  for (const auto& [set, name] :
       {std::pair(c.unlabelled, "unlabelled"), std::pair(c.dynamic, "dynamic"), std::pair(c.living, "living"),
        std::pair(c.ground, "ground"), std::pair(c.ignored, "ignored"), std::pair(c.airborne, "airborne")}) {
    if (set) flags.emplace_back(name);
  }
  return flags;
}

bool isId(py::handle key) {
  return PyIndex_Check(key.ptr()) != 0 && !PyBool_Check(key.ptr());
}

bool isClass(py::handle key) {
  return py::isinstance<py::str>(key) || isId(key) || py::isinstance<SemanticClass>(key);
}

/// @param key a name, an id or a class. @return nullptr if the table has no such class.
const SemanticClass* findClass(const ClassTable& table, py::handle key) {
  if (py::isinstance<SemanticClass>(key)) {
    const auto& wanted = py::cast<const SemanticClass&>(key);
    const SemanticClass* const own = table.find(wanted.id);
    return own && own->name == wanted.name ? own : nullptr;
  }
  for (const SemanticClass& c : table.classes()) {
    const bool named = py::isinstance<py::str>(key) && py::cast<std::string>(key) == c.name;
    if (named || (isId(key) && py::int_(c.id).equal(key))) return &c;
  }
  return nullptr;
}

const SemanticClass& classAt(const ClassTable& table, py::handle key) {
  if (const SemanticClass* const found = findClass(table, key)) return *found;
  throw py::key_error("class table '" + table.name() + "' has no class " +
                      py::cast<std::string>(py::repr(key)));
}

py::array_t<std::uint8_t> colorsOf(const ClassTable& table) {
  py::array_t<std::uint8_t> colors({256, 3});
  std::fill_n(colors.mutable_data(), colors.size(), std::uint8_t{255});
  for (const SemanticClass& c : table.classes()) {
    std::copy(c.color.begin(), c.color.end(), colors.mutable_data(c.id, 0));
  }
  return colors;
}

constexpr char kClassesHelp[] =
    "classes: a name, an id, a SemanticClass, or an iterable of them.\n\n"
    "Raises ValueError for a class that the table lacks.";

void addFilter(py::module& m) {
  py::class_<TableFilter>(
      m, "ClassFilter",
      "A set of classes of a table, for queries. Made by ClassTable.only and ClassTable.all_but.")
      .def_property_readonly(
          "ids",
          [](const TableFilter& f) {
            const auto classes = f.classes();
            py::array_t<ClassId> ids(static_cast<py::ssize_t>(classes.size()));
            std::transform(classes.begin(), classes.end(), ids.mutable_data(),
                           [](const SemanticClass* c) { return c->id; });
            return ids;
          },
          "The ids of the classes, in the order of the table: (N,), uint8.")
      .def_property_readonly(
          "names",
          [](const TableFilter& f) {
            std::vector<std::string> names;
            for (const SemanticClass* const c : f.classes()) names.push_back(c->name);
            return names;
          },
          "The names of the classes, in the order of the table.")
      .def("__len__", [](const TableFilter& f) { return f.classes().size(); })
      .def(
          "__contains__",
          [](const TableFilter& f, py::handle key) {
            const SemanticClass* const found = findClass(*f.table, key);
            return found && f.filter.contains(found->id);
          },
          py::arg("class_"), "Whether a class, given by a name, an id or a SemanticClass, is in the set.")
      .def("__repr__", [](const TableFilter& f) {
        return "<bki_mapping.ClassFilter: " + std::to_string(f.classes().size()) + " of the " +
               std::to_string(f.table->size()) + " classes of '" + f.table->name() + "'>";
      });
}

}  // namespace

std::vector<ClassId> orderOf(const SharedTable& table, py::handle classes, const char* name) {
  std::vector<ClassId> ids;
  if (classes.is_none()) return ids;
  const auto wrong = [&](py::handle object) {
    return py::type_error(std::string(name) +
                          " must be a class (a name, an id or a SemanticClass) or a list of them, not " +
                          typeName(object));
  };
  const auto add = [&](py::handle each) {
    if (!isClass(each)) throw wrong(each);
    const SemanticClass* const found = findClass(*table, each);
    if (found) return ids.push_back(found->id);
    if (py::isinstance<py::str>(each)) ClassFilter::of(*table, {py::cast<std::string>(each)});  // throws
    throw std::invalid_argument("class table '" + table->name() + "' has no class " +
                                py::cast<std::string>(py::repr(each)) + "; see ClassTable for those it has");
  };
  if (isClass(classes)) {
    add(classes);
  } else if (py::isinstance<py::iterable>(classes)) {
    for (const py::handle each : py::reinterpret_borrow<py::iterable>(classes)) add(each);
  } else {
    throw wrong(classes);
  }
  return ids;
}

ClassFilter filterOf(const SharedTable& table, py::handle classes) {
  if (classes.is_none()) return ClassFilter::all();
  if (py::isinstance<TableFilter>(classes)) {
    const auto& given = py::cast<const TableFilter&>(classes);
    const std::vector<SemanticClass>& theirs = given.table->classes();
    const bool same = theirs.size() == table->size() &&
                      std::all_of(theirs.begin(), theirs.end(), [&](const SemanticClass& each) {
                        const SemanticClass* const own = table->find(each.id);
                        return own && own->name == each.name;
                      });
    if (given.table->name() != table->name() || !same) {
      throw std::invalid_argument("the filter is of class table '" + given.table->name() + "', the map of '" +
                                  table->name() + "'; make it from Map.classes");
    }
    return given.filter;
  }
  ClassFilter filter;
  for (const ClassId id : orderOf(table, classes, "classes")) filter.insert(id);
  return filter;
}

void addClasses(py::module& m) {
  py::class_<SemanticClass>(m, "SemanticClass", "A class of a table.")
      .def_readonly("id", &SemanticClass::id, "Unique in the table, 0 to 253.")
      .def_readonly("name", &SemanticClass::name, "Unique in the table.")
      .def_property_readonly(
          "color", [](const SemanticClass& c) { return py::make_tuple(c.color[0], c.color[1], c.color[2]); },
          "Red, green and blue, 0 to 255.")
      .def_readonly("raw", &SemanticClass::raw, "Labels of the data set that mean this class.")
      .def_property_readonly(
          "flags", &flagsOf,
          "Flags of the class in the table's file: unlabelled, dynamic, living, ground, ignored.")
      .def("__repr__", [](const SemanticClass& c) {
        return "<bki_mapping.SemanticClass " + std::to_string(c.id) + ": '" + c.name + "'>";
      });
  addFilter(m);
  using Table = std::shared_ptr<ClassTable>;
  py::class_<ClassTable, Table>(m, "ClassTable",
                                "The classes of a data set, and the labels that stand for them. Immutable.")
      .def(py::init([](py::handle name_or_file) {
             return std::make_shared<ClassTable>(loadClassTable(pathOf(name_or_file, "name_or_file")));
           }),
           py::arg("name_or_file"),
           "Read a class table: one that comes with the package by its name, such as 'semantic_kitti', or a "
           "YAML file.\n\nRaises ValueError if there is no such table, or the file is no class table.")
      .def_property_readonly("name", &ClassTable::name, "The name of the table.")
      .def_property_readonly("label_mask", &ClassTable::labelMask,
                             "Which bits of a label are the class; the others may hold an instance.")
      .def_property_readonly("colors", &colorsOf,
                             "The colour of each class id: (256, 3), uint8; white where no class has the id.")
      .def(
          "only",
          [](const Table& table, py::handle classes) {
            return TableFilter{table, filterOf(table, classes)};
          },
          py::arg("classes"), (std::string("The set of these classes.\n\n") + kClassesHelp).c_str())
      .def(
          "all_but",
          [](const Table& table, py::handle classes) {
            return TableFilter{table, ClassFilter::allBut(filterOf(table, classes))};
          },
          py::arg("classes"),
          (std::string("The set of all other classes: \"anything but ground\".\n\n") + kClassesHelp).c_str())
      .def("__len__", &ClassTable::size)
      .def(
          "__iter__",
          [](const ClassTable& table) {
            return py::make_iterator(table.classes().begin(), table.classes().end());
          },
          py::keep_alive<0, 1>())
      .def("__getitem__", &classAt, py::arg("id_or_name"), py::return_value_policy::reference_internal,
           "The class with an id or a name. Raises KeyError if there is none.")
      .def("__repr__", [](const ClassTable& table) {
        return "<bki_mapping.ClassTable '" + table.name() + "' of " + std::to_string(table.size()) +
               " classes>";
      });
}

}  // namespace bki_mapping::python
