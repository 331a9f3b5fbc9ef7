/// @file A view of contiguous values.
#pragma once

#include <cstddef>
#include <utility>

namespace bki_mapping {

/// A view of contiguous values that it does not own, such as those of a std::vector or a NumPy array; like
/// std::span of C++20. Span<const T> reads only.
template <typename T>
class Span {
 public:
  Span() = default;
  Span(T* data, std::size_t size) : data_(data), size_(size) {}
  template <typename Vector, typename = decltype(static_cast<T*>(std::declval<Vector&>().data()))>
  Span(Vector&& vector) : data_(vector.data()), size_(vector.size()) {}  // NOLINT: as std::span

  T* data() const { return data_; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  T& operator[](std::size_t n) const { return data_[n]; }
  T* begin() const { return data_; }
  T* end() const { return data_ + size_; }

 private:
  T* data_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace bki_mapping
