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

/// The name of an object's type, for messages.
std::string typeName(py::handle object);

/// Issues a UserWarning. @throws pybind11::error_already_set if warnings are errors.
void warn(const std::string& sentence);

/// An object as an array. @param wanted what it must be, for messages. @throws std::invalid_argument also if
/// it is a masked array of NumPy with masked values: as an array it would show what lies below the mask.
py::array arrayOf(py::handle object, const std::string& name, const std::string& wanted);

/// Points as NumPy has them, without a copy where they are contiguous single or double precision.
class Points {
 public:
  /// @param object anything that numpy.asarray makes an array of numbers of shape (N, 3) of.
  Points(py::handle object, const std::string& name);

  std::size_t size() const { return size_; }
  bool isFloat() const { return is_float_; }
  /// The points in single precision; isFloat() must be true.
  const Eigen::Vector3f* floats() const { return static_cast<const Eigen::Vector3f*>(data_); }
  /// The points in double precision; isFloat() must be false.
  const Eigen::Vector3d* doubles() const { return static_cast<const Eigen::Vector3d*>(data_); }
  Eigen::Vector3d at(std::size_t i) const { return is_float_ ? floats()[i].cast<double>() : doubles()[i]; }
  /// Calls use(Span<const Eigen::Vector3f>) or use(Span<const Eigen::Vector3d>).
  template <typename Use>
  void visit(Use&& use) const {
    is_float_ ? use(Span<const Eigen::Vector3f>(floats(), size_))
              : use(Span<const Eigen::Vector3d>(doubles(), size_));
  }

 private:
  py::array array_;
  const void* data_ = nullptr;
  std::size_t size_ = 0;
  bool is_float_ = false;
};

/// Labels as NumPy has them, without a copy if they are contiguous uint32. Negative ones become what they are
/// in two's complement: -1 is kNoLabel.
class Labels {
 public:
  /// @param object anything that numpy.asarray makes an array of integers of shape (N,) of.
  Labels(py::handle object, const std::string& name);

  std::size_t size() const { return static_cast<std::size_t>(array_.size()); }
  const std::uint32_t* data() const { return array_.data(); }

 private:
  py::array_t<std::uint32_t> array_;
};

/// Points in double precision, without a copy if they are contiguous float64.
class DoublePoints {
 public:
  DoublePoints(py::handle object, const std::string& name);

  std::size_t size() const { return static_cast<std::size_t>(array_.shape(0)); }
  Span<const Eigen::Vector3d> span() const {
    return {reinterpret_cast<const Eigen::Vector3d*>(array_.data()), size()};
  }

 private:
  py::array_t<double> array_;
};

/// Indices of voxels or blocks, without a copy if they are contiguous int32.
class Indices {
 public:
  /// @param object anything that numpy.asarray makes an array of integers of shape (N, 3) of.
  Indices(py::handle object, const std::string& name);

  Span<const GridIndex> span() const {
    static_assert(sizeof(GridIndex) == 3 * sizeof(std::int32_t));
    return {reinterpret_cast<const GridIndex*>(array_.data()), static_cast<std::size_t>(array_.shape(0))};
  }

 private:
  py::array_t<std::int32_t> array_;
};

/// One number for each of many things, or the same for all of them.
class Numbers {
 public:
  /// @param count of the things, which messages call `things`.
  Numbers(py::handle object, const std::string& name, std::size_t count, const std::string& things);

  double at(std::size_t i) const { return array_.data()[array_.size() == 1 ? 0 : i]; }

 private:
  py::array_t<double> array_;
};

double numberOf(py::handle object, const std::string& name);
std::size_t countOf(py::handle object, const std::string& name);
/// The time of a scan [ns].
std::uint64_t stampOf(py::handle object);
bool truthOf(py::handle object, const std::string& name);
std::string textOf(py::handle object, const std::string& name);
/// Two numbers, which may be infinite or NaN.
Eigen::Vector2d pairOf(py::handle object, const std::string& name);
/// Three numbers, which may be infinite or NaN.
Eigen::Vector3d tripleOf(py::handle object, const std::string& name);
/// Three finite or infinite numbers, not NaN.
Eigen::Vector3d vectorOf(py::handle object, const std::string& name);
/// Whether a matrix is a rotation and a translation.
bool isPose(const Eigen::Matrix4d& matrix);
/// Poses of shape (N, 4, 4). Their rotations are not looked at.
std::vector<Eigen::Isometry3d> posesOf(py::handle object, const std::string& name);
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

/// The lower and the upper corner of a box [m], (2, 3), float64; None if it is empty.
py::object cornersOf(const Eigen::AlignedBox3d& box);

/// An array that owns a vector; nothing is copied.
template <typename T>
py::array ownedArray(std::vector<T> values, const py::dtype& type) {
  auto owner = std::make_unique<std::vector<T>>(std::move(values));
  const std::vector<T>& kept = *owner;
  const py::capsule base(owner.release(), [](void* vector) { delete static_cast<std::vector<T>*>(vector); });
  return py::array(type, {static_cast<py::ssize_t>(kept.size())}, {static_cast<py::ssize_t>(sizeof(T))},
                   kept.data(), base);
}

/// A field of a structured array: its name, its format, where it lies in the struct, and of how many values
/// it is an array.
struct Field {
  const char* name;
  const char* format;
  std::size_t offset;
  int count = 1;
};
py::dtype structType(const std::vector<Field>& fields, std::size_t bytes);

/// A read-only array that shows memory of an object, which it keeps alive.
template <typename T>
py::array viewOf(const py::object& owner, const T* data, const std::vector<py::ssize_t>& shape) {
  py::array array(py::dtype::of<T>(), shape, data, owner);
  array.attr("setflags")(false);
  return array;
}

}  // namespace bki_mapping::python
