/// @file The classes of which a block has evidence.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <utility>

#include "bki_mapping/core/types.h"

namespace bki_mapping {

/// Different classes, by rising id. A few lie in the list itself, which is enough for most blocks: compared
/// with a vector, reading them takes one cache line less, and a new block one allocation less.
class ClassList {
 public:
  ClassList() = default;
  /// @param ids different ones, by rising id.
  ClassList(std::initializer_list<ClassId> ids) {
    reserve(ids.size());
    std::copy(ids.begin(), ids.end(), data());
    size_ = static_cast<std::uint8_t>(ids.size());
  }
  ClassList(const ClassList& other) { *this = other; }
  ClassList(ClassList&& other) noexcept { *this = std::move(other); }
  ClassList& operator=(const ClassList& other) {
    reserve(other.size());
    std::copy(other.begin(), other.end(), data());
    size_ = other.size_;
    return *this;
  }
  ClassList& operator=(ClassList&& other) noexcept {
    std::swap(size_, other.size_);
    std::swap(few_, other.few_);
    many_.swap(other.many_);
    return *this;
  }
  ~ClassList() = default;

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  const ClassId* begin() const { return many_ ? many_.get() : few_.data(); }
  const ClassId* end() const { return begin() + size_; }
  ClassId operator[](std::size_t position) const { return begin()[position]; }
  bool operator==(const ClassList& other) const {
    return std::equal(begin(), end(), other.begin(), other.end());
  }
  bool operator!=(const ClassList& other) const { return !(*this == other); }

  /// The position of a class, or where it would be inserted.
  std::size_t positionOf(ClassId id) const {
    return static_cast<std::size_t>(std::lower_bound(begin(), end(), id) - begin());
  }
  bool has(ClassId id, std::size_t position) const { return position < size() && begin()[position] == id; }

  /// Allocates memory for so many classes.
  void reserve(std::size_t size) {
    if (size <= kFew || many_) return;
    auto many = std::make_unique<ClassId[]>(kMost);
    std::copy(begin(), end(), many.get());
    many_ = std::move(many);
  }
  /// Inserts a class at its position. Allocates nothing after reserve().
  void insert(std::size_t position, ClassId id) {
    reserve(size() + 1);
    ClassId* const at = data() + position;
    std::copy_backward(at, data() + size_, data() + size_ + 1);
    *at = id;
    ++size_;
  }
  void erase(std::size_t position) noexcept {
    ClassId* const at = data() + position;
    std::copy(at + 1, data() + size_, at);
    --size_;
  }
  /// Returns memory that is not needed.
  void shrink() noexcept {
    if (!many_ || size() > kFew) return;
    std::copy(begin(), end(), few_.begin());
    many_.reset();
  }

  /// Memory beside the list itself [bytes].
  std::size_t bytes() const { return many_ ? kMost : 0; }

 private:
  static constexpr std::size_t kFew = 15;
  static constexpr std::size_t kMost = kMaxClasses + 1;  ///< with kFreeClass

  ClassId* data() { return many_ ? many_.get() : few_.data(); }

  std::uint8_t size_ = 0;
  std::array<ClassId, kFew> few_ = {};
  std::unique_ptr<ClassId[]> many_;  ///< for kMost; without it, all are in few_
};

}  // namespace bki_mapping
