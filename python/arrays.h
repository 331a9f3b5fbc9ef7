/// @file Between Python objects and C++ values. Every function throws std::invalid_argument, which is
/// ValueError in Python, or pybind11::type_error, in one sentence that names the argument.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "bki_mapping/core/types.h"

namespace bki_mapping::python {

namespace py = pybind11;

/// Points as NumPy has them, without a copy where they are contiguous single or double precision.
class Points {
 public:
  /// @param object anything that numpy.asarray makes an array of numbers of shape (N, 3) of.
  Points(py::handle object, const std::string& name);

  std::size_t size() const { return size_; }
  bool isFloat() const { return is_float_; }
  /// The points in single precision; isFloat() must be true.
  const Eigen::Vector3f* floats() const { return static_cast<const Eigen::Vector3f*>(data_); }
  Eigen::Vector3d at(std::size_t i) const {
    if (is_float_) return floats()[i].cast<double>();
    return static_cast<const Eigen::Vector3d*>(data_)[i];
  }

 private:
  py::array array_;
  const void* data_ = nullptr;
  std::size_t size_ = 0;
  bool is_float_ = false;
};

/// Labels as NumPy has them, without a copy if they are contiguous uint32.
class Labels {
 public:
  /// @param object anything that numpy.asarray makes an array of integers of shape (N,) of.
  Labels(py::handle object, const std::string& name);

  std::size_t size() const { return static_cast<std::size_t>(array_.size()); }
  const std::uint32_t* data() const { return array_.data(); }

 private:
  py::array_t<std::uint32_t> array_;
};

/// Three finite or infinite numbers, not NaN.
Eigen::Vector3d vectorOf(py::handle object, const std::string& name);
/// A block's index, of three integers.
GridIndex indexOf(py::handle object, const std::string& name);
/// A str, bytes or os.PathLike.
std::string pathOf(py::handle object, const std::string& name);
/// A word, or the words of a list joined by commas.
std::string wordsOf(py::handle object, const std::string& name);
/// Settings of a dict, whose values may be dicts again, by flat names, as text.
std::map<std::string, std::string> settingsOf(const py::dict& settings);

/// Indices as an array of shape (N, 3), int32.
py::array_t<std::int32_t> indexArray(const std::vector<GridIndex>& indices);

/// An array that owns a vector; nothing is copied.
template <typename T>
py::array ownedArray(std::vector<T> values, const py::dtype& type) {
  auto owner = std::make_unique<std::vector<T>>(std::move(values));
  const std::vector<T>& kept = *owner;
  const py::capsule base(owner.release(), [](void* vector) { delete static_cast<std::vector<T>*>(vector); });
  return py::array(type, {static_cast<py::ssize_t>(kept.size())}, {static_cast<py::ssize_t>(sizeof(T))},
                   kept.data(), base);
}

/// A field of a structured array: its name, its format, and where it lies in the struct.
struct Field {
  const char* name;
  const char* format;
  std::size_t offset;
};
py::dtype structType(const std::vector<Field>& fields, std::size_t bytes);

}  // namespace bki_mapping::python
