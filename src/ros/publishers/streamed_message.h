/// @file Messages whose large part is written straight into the buffer that is sent, by several threads. A
/// streamed message has a type of its own, but is, to subscribers, the message that it stands for.
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "parallel/thread_pool.h"

namespace bki_mapping::ros_interface {

/// The number of threads that fill in a message. More than a few do not help: memory limits them.
/// @param blocks of which the message is made; few are not worth the start of threads.
inline int publishingThreads(std::size_t blocks) {
  constexpr std::size_t kManyBlocks = 256;
  constexpr int kMostThreads = 4;
  return blocks < kManyBlocks ? 1 : std::min(threadCount(0), kMostThreads);
}

/// @return count * size. @throws std::length_error if subscribers would refuse a message of so many bytes.
inline std::uint32_t messageBytes(std::size_t count, std::size_t size) {
  constexpr std::size_t kMostBytes = 1000000000;
  if (count > kMostBytes / size) {
    throw std::length_error("a message may have at most " + std::to_string(kMostBytes) + " bytes");
  }
  return static_cast<std::uint32_t>(count * size);
}

/// A trait of ROS for the message that a streamed one stands for, such as its MD5 sum.
template <typename Trait>
struct SameTrait {
  static const char* value() { return Trait::value(); }
  template <typename Streamed>
  static const char* value(const Streamed&) {
    return value();
  }
};

/// Serialises a streamed message, whose forEachMember visits its members in the order of the .msg file.
template <typename Streamed>
struct MemberSerializer {
  static void write(ros::serialization::OStream& stream, const Streamed& message) {
    message.forEachMember([&stream](const auto& member) { stream.next(member); });
  }
  static std::uint32_t serializedLength(const Streamed& message) {
    std::uint32_t length = 0;
    message.forEachMember(
        [&length](const auto& member) { length += ros::serialization::serializationLength(member); });
    return length;
  }
};

/// Serialises a streamed array, which has count(), the bytes() of all elements, and write(to).
template <typename Streamed>
struct ArraySerializer {
  static void write(ros::serialization::OStream& stream, const Streamed& array) {
    stream.next(array.count());
    array.write(stream.advance(array.bytes()));
  }
  static std::uint32_t serializedLength(const Streamed& array) {
    return static_cast<std::uint32_t>(sizeof(std::uint32_t)) + array.bytes();
  }
};

}  // namespace bki_mapping::ros_interface
