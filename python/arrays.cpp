#include "arrays.h"

#include <limits>
#include <stdexcept>

namespace bki_mapping::python {
namespace {

void refuseMask(py::handle object, const std::string& name) {
  if (!py::hasattr(object, "mask")) return;
  if (!py::cast<bool>(py::module::import("numpy.ma").attr("is_masked")(object))) return;
  throw std::invalid_argument(
      name +
      " has masked values, which would count like the others; leave their rows out of all "
      "arrays, or give them a value with filled()");
}

std::string shapeText(const py::array& array) {
  return py::str(array.attr("shape"));
}

std::string dtypeText(const py::array& array) {
  return py::str(array.dtype());
}

template <typename T>
constexpr int kAligned = py::array::c_style | py::array::forcecast | py::detail::npy_api::NPY_ARRAY_ALIGNED_;

/// A contiguous, aligned array of T in the processor's byte order; the same array if it is one.
template <typename T>
py::array_t<T, kAligned<T>> contiguous(const py::array& array) {
  return py::array_t<T, kAligned<T>>(array);
}

bool isNumber(char kind) {
  return kind == 'f' || kind == 'i' || kind == 'u';
}

bool isIntegerKind(char kind) {
  return kind == 'i' || kind == 'u';
}

/// An array of shape (N, 3). @param things what it holds: "numbers". @param holds whether a kind of dtype is
/// that.
py::array tripletsOf(py::handle object, const std::string& name, const std::string& things,
                     bool (*holds)(char)) {
  const std::string wanted = "an array of " + things + " of shape (N, 3)";
  const py::array array = arrayOf(object, name, wanted);
  if (!holds(array.dtype().kind())) {
    throw py::type_error(name + " must be " + wanted + ", not of dtype " + dtypeText(array));
  }
  if (array.ndim() != 2 || array.shape(1) != 3) {
    throw std::invalid_argument(name + " must be " + wanted + ", not of shape " + shapeText(array));
  }
  return array;
}

/// A few numbers. @param wanted for messages: "two numbers".
template <int kCount>
Eigen::Matrix<double, kCount, 1> numbersOf(py::handle object, const std::string& name,
                                           const std::string& wanted) {
  const py::array array = arrayOf(object, name, wanted);
  if (!isNumber(array.dtype().kind()) || array.ndim() != 1 || array.size() != kCount) {
    throw std::invalid_argument(name + " must be " + wanted + ", not of dtype " + dtypeText(array) +
                                " and shape " + shapeText(array));
  }
  const auto values = contiguous<double>(array);
  return Eigen::Map<const Eigen::Matrix<double, kCount, 1>>(values.data());
}

/// Whether the object counts as an integer, as those of NumPy do.
bool isInteger(py::handle object) {
  return PyIndex_Check(object.ptr()) != 0;
}

/// The integer of at most 63 bits; -1 for everything else.
py::ssize_t integerOf(py::handle object) {
  const py::ssize_t value =
      isInteger(object) ? PyNumber_AsSsize_t(object.ptr(), PyExc_OverflowError) : py::ssize_t{-1};
  if (value < 0) PyErr_Clear();
  return value < 0 ? py::ssize_t{-1} : value;
}

/// The value of a setting as YAML writes it.
std::string settingText(py::handle value, const std::string& name) {
  const std::string type = typeName(value);
  if (py::isinstance<py::str>(value)) return py::cast<std::string>(value);
  if (type == "bool" || type == "bool_")
    return py::cast<bool>(py::bool_(py::reinterpret_borrow<py::object>(value))) ? "true" : "false";
  if (isInteger(value)) return py::str(py::int_(py::reinterpret_borrow<py::object>(value)));
  if (PyFloat_Check(value.ptr()) != 0 || py::hasattr(value, "__float__")) {
    return py::repr(py::float_(py::reinterpret_borrow<py::object>(value)));
  }
  throw std::invalid_argument("parameter '" + name + "' must be a number, a bool or a str, not " + type);
}

void flatten(const py::dict& settings, const std::string& group, std::map<std::string, std::string>& values) {
  for (const auto& [key, value] : settings) {
    const std::string name = group + py::cast<std::string>(py::str(key));
    if (py::isinstance<py::dict>(value)) {
      flatten(py::reinterpret_borrow<py::dict>(value), name + "/", values);
    } else if (!values.emplace(name, settingText(value, name)).second) {
      throw std::invalid_argument("parameter '" + name + "' is given twice; keep one");
    }
  }
}

}  // namespace

void warn(const std::string& sentence) {
  if (PyErr_WarnEx(PyExc_UserWarning, sentence.c_str(), 1) != 0) throw py::error_already_set();
}

std::string typeName(py::handle object) {
  return py::str(py::handle(reinterpret_cast<PyObject*>(Py_TYPE(object.ptr()))).attr("__name__"));
}

py::array arrayOf(py::handle object, const std::string& name, const std::string& wanted) {
  refuseMask(object, name);
  py::array array = py::array::ensure(object);
  if (array) return array;
  PyErr_Clear();
  throw py::type_error(name + " must be " + wanted + ", not " + typeName(object));
}

Points::Points(py::handle object, const std::string& name) {
  const py::array array = tripletsOf(object, name, "numbers", &isNumber);
  size_ = static_cast<std::size_t>(array.shape(0));
  is_float_ = array.dtype().kind() == 'f' && array.itemsize() <= 4;
  if (is_float_) {
    array_ = contiguous<float>(array);
  } else {
    array_ = contiguous<double>(array);
  }
  data_ = array_.data();
}

Labels::Labels(py::handle object, const std::string& name) {
  const std::string wanted = "an array of integers of shape (N,)";
  const py::array array = arrayOf(object, name, wanted);
  const char kind = array.dtype().kind();
  const bool empty_list = array.size() == 0 && kind == 'f';  // NumPy's dtype of []
  if (!isIntegerKind(kind) && !empty_list) {
    throw py::type_error(name + " must be " + wanted + ", not of dtype " + dtypeText(array));
  }
  if (array.ndim() != 1) {
    throw std::invalid_argument(name + " must be " + wanted + ", not of shape " + shapeText(array));
  }
  if (array.size() > 0 && !(kind == 'u' && array.itemsize() <= 4)) {
    const py::object least = array.attr("min")(), most = array.attr("max")();
    constexpr auto kLeast = std::numeric_limits<std::int32_t>::min();
    constexpr auto kMost = std::numeric_limits<std::uint32_t>::max();
    const bool too_low = least < py::int_(kLeast);
    if (too_low || most > py::int_(kMost)) {
      const std::string wrong = py::str(py::handle(too_low ? least : most));
      throw std::invalid_argument(name + " must be from " + std::to_string(kLeast) + " to " +
                                  std::to_string(kMost) + ", but " + wrong + " is among them");
    }
  }
  array_ = contiguous<std::uint32_t>(array);
}

DoublePoints::DoublePoints(py::handle object, const std::string& name)
    : array_(contiguous<double>(tripletsOf(object, name, "numbers", &isNumber))) {}

Indices::Indices(py::handle object, const std::string& name) {
  const py::array array = tripletsOf(object, name, "integers", &isIntegerKind);
  if (array.size() > 0 && array.itemsize() > 2) {
    const py::object least = array.attr("min")(), most = array.attr("max")();
    using Limits = std::numeric_limits<std::int32_t>;
    if (least < py::int_(Limits::min()) || most > py::int_(Limits::max())) {
      throw std::invalid_argument(name + " must be integers of 32 bits");
    }
  }
  array_ = contiguous<std::int32_t>(array);
}

Numbers::Numbers(py::handle object, const std::string& name, std::size_t count, const std::string& things) {
  const std::string wanted =
      "a number, or " + std::to_string(count) + " of them, one for each of the " + things;
  const py::array array = arrayOf(object, name, wanted);
  if (!isNumber(array.dtype().kind())) {
    throw py::type_error(name + " must be " + wanted + ", not of dtype " + dtypeText(array));
  }
  if (array.ndim() > 1 || (array.ndim() == 1 && static_cast<std::size_t>(array.size()) != count)) {
    throw std::invalid_argument(name + " must be " + wanted + ", not of shape " + shapeText(array));
  }
  array_ = contiguous<double>(array);
}

double numberOf(py::handle object, const std::string& name) {
  const double value = PyFloat_AsDouble(object.ptr());
  if (PyErr_Occurred() == nullptr) return value;
  PyErr_Clear();
  throw py::type_error(name + " must be a number, not " + typeName(object));
}

std::size_t countOf(py::handle object, const std::string& name) {
  const py::ssize_t count = integerOf(object);
  if (count < 0) throw std::invalid_argument(name + " must be an integer, 0 or more, of at most 63 bits");
  return static_cast<std::size_t>(count);
}

std::uint64_t stampOf(py::handle object) {
  const py::ssize_t stamp = integerOf(object);
  if (stamp >= 0) return static_cast<std::uint64_t>(stamp);
  throw std::invalid_argument(
      "stamp must be an integer of nanoseconds, 0 or more, of at most 63 bits; for a time t in seconds, give "
      "int(t * 1e9)");
}

bool truthOf(py::handle object, const std::string& name) {
  const std::string type = typeName(object);
  if (type == "bool" || type == "bool_") return PyObject_IsTrue(object.ptr()) == 1;
  throw py::type_error(name + " must be True or False, not " + type);
}

std::string textOf(py::handle object, const std::string& name) {
  if (py::isinstance<py::str>(object)) return py::cast<std::string>(object);
  throw py::type_error(name + " must be a str, not " + typeName(object));
}

Eigen::Vector2d pairOf(py::handle object, const std::string& name) {
  return numbersOf<2>(object, name, "two numbers");
}

Eigen::Vector3d tripleOf(py::handle object, const std::string& name) {
  return numbersOf<3>(object, name, "three numbers");
}

bool isPose(const Eigen::Matrix4d& matrix) {
  constexpr double kTolerance = 1e-3;
  const Eigen::Matrix3d linear = matrix.topLeftCorner<3, 3>();
  const Eigen::Matrix3d square = linear.transpose() * linear;
  return ((square - Eigen::Matrix3d::Identity()).array().abs() < kTolerance).all() &&
         linear.determinant() > 0.0 && matrix.row(3) == Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0);
}

std::vector<Eigen::Isometry3d> posesOf(py::handle object, const std::string& name) {
  const std::string wanted = "an array of numbers of shape (N, 4, 4)";
  const py::array array = arrayOf(object, name, wanted);
  if (!isNumber(array.dtype().kind())) {
    throw py::type_error(name + " must be " + wanted + ", not of dtype " + dtypeText(array));
  }
  if (array.ndim() != 3 || array.shape(1) != 4 || array.shape(2) != 4) {
    throw std::invalid_argument(name + " must be " + wanted + ", not of shape " + shapeText(array));
  }
  const auto values = contiguous<double>(array);
  std::vector<Eigen::Isometry3d> poses(static_cast<std::size_t>(array.shape(0)));
  const double* from = values.data();
  for (std::size_t n = 0; n < poses.size(); ++n, from += 16) {
    poses[n].matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(from);
    if (poses[n].matrix().row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)) {
      throw std::invalid_argument(name + "[" + std::to_string(n) + "] must have 0, 0, 0, 1 in the last row");
    }
  }
  return poses;
}

Eigen::Vector3d vectorOf(py::handle object, const std::string& name) {
  const Eigen::Vector3d vector = tripleOf(object, name);
  if (vector.array().isNaN().any()) throw std::invalid_argument(name + " has a coordinate that is NaN");
  return vector;
}

GridIndex indexOf(py::handle object, const std::string& name) {
  const py::array array = arrayOf(object, name, "three integers");
  const char kind = array.dtype().kind();
  const auto outside = [](std::int64_t i) {
    return i < std::numeric_limits<std::int32_t>::min() || i > std::numeric_limits<std::int32_t>::max();
  };
  if (isIntegerKind(kind) && array.ndim() == 1 && array.size() == 3) {
    const auto values = contiguous<std::int64_t>(array);
    if (!outside(values.at(0)) && !outside(values.at(1)) && !outside(values.at(2))) {
      return {static_cast<std::int32_t>(values.at(0)), static_cast<std::int32_t>(values.at(1)),
              static_cast<std::int32_t>(values.at(2))};
    }
  }
  throw std::invalid_argument(name + " must be three integers of 32 bits");
}

std::string pathOf(py::handle object, const std::string& name) {
  const auto path = py::reinterpret_steal<py::object>(PyOS_FSPath(object.ptr()));
  if (!path) {
    PyErr_Clear();
    throw py::type_error(name + " must be a str or a path, not " + typeName(object));
  }
  if (py::isinstance<py::bytes>(path)) return py::cast<std::string>(path);
  const auto bytes = py::reinterpret_steal<py::bytes>(PyUnicode_EncodeFSDefault(path.ptr()));
  if (!bytes) throw py::error_already_set();
  return bytes;
}

std::string wordsOf(py::handle object, const std::string& name) {
  if (py::isinstance<py::str>(object)) return py::cast<std::string>(object);
  std::string text;
  if (py::isinstance<py::iterable>(object)) {
    for (const py::handle word : py::reinterpret_borrow<py::iterable>(object)) {
      if (!py::isinstance<py::str>(word)) break;
      text += (text.empty() ? "" : ",") + py::cast<std::string>(word);
    }
  }
  if (text.empty()) throw py::type_error(name + " must be a str, or a list of them");
  return text;
}

std::map<std::string, std::string> settingsOf(const py::dict& settings) {
  std::map<std::string, std::string> values;
  flatten(settings, "", values);
  return values;
}

py::array_t<std::int32_t> indexArray(const std::vector<GridIndex>& indices) {
  static_assert(sizeof(GridIndex) == 3 * sizeof(std::int32_t));
  py::array_t<std::int32_t> array({static_cast<py::ssize_t>(indices.size()), py::ssize_t{3}});
  auto* to = array.mutable_data();
  for (const GridIndex& index : indices) {
    *to++ = index.x;
    *to++ = index.y;
    *to++ = index.z;
  }
  return array;
}

py::object cornersOf(const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return py::none();
  py::array_t<double> corners({2, 3});
  std::copy_n(box.min().data(), 3, corners.mutable_data(0, 0));
  std::copy_n(box.max().data(), 3, corners.mutable_data(1, 0));
  return py::object(std::move(corners));
}

py::dtype structType(const std::vector<Field>& fields, std::size_t bytes) {
  py::list names, formats, offsets;
  for (const Field& field : fields) {
    names.append(field.name);
    if (field.count == 1) {
      formats.append(field.format);
    } else {
      formats.append(py::make_tuple(field.format, field.count));
    }
    offsets.append(field.offset);
  }
  return py::dtype(names, formats, offsets, static_cast<py::ssize_t>(bytes));
}

}  // namespace bki_mapping::python
