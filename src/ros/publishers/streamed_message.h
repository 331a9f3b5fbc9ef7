/// @file Messages whose large part is written straight into the buffer that is sent, by several threads. To
/// subscribers, a streamed message is the message that it stands for.
#pragma once

#include <ros/message_traits.h>
#include <ros/serialization.h>
#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "parallel/thread_pool.h"

namespace bki_mapping::ros_interface {

/// @return count * size. @throws std::length_error if subscribers would refuse a message of that size.
inline std::uint32_t messageBytes(std::size_t count, std::size_t size) {
  constexpr std::size_t kMostBytes = 1000000000;
  if (count > kMostBytes / size) {
    throw std::length_error("a message may have at most " + std::to_string(kMostBytes) + " bytes");
  }
  return static_cast<std::uint32_t>(count * size);
}

/// Asks for large pages for memory that is about to be written. The system hands out a buffer of many MB
/// anew each time; with pages of 4 kB, mapping them takes as long as filling them.
inline void useLargePages(std::uint8_t* data, std::size_t bytes) {
  constexpr std::uintptr_t kPage = std::uintptr_t{1} << 21;
  const auto begin = (reinterpret_cast<std::uintptr_t>(data) + kPage - 1) / kPage * kPage,
             end = (reinterpret_cast<std::uintptr_t>(data) + bytes) / kPage * kPage;
  // Only a hint, so that it does not matter whether the system follows.
  if (begin < end) madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
}

/// A streamed message. @tparam Fields has the members of Fields::Message, which it stands for, and
/// visitMembers, which passes all of them to one call, in the order of the .msg file.
template <typename Fields>
struct StreamedMessage : Fields {
  using Fields::Fields;
  using Message = typename Fields::Message;

  // ROS asks by these names for what a message is.
  static const std::string& __s_getMD5Sum() { return kept<ros::message_traits::MD5Sum<Message>>(); }
  static const std::string& __s_getDataType() { return kept<ros::message_traits::DataType<Message>>(); }
  static const std::string& __s_getMessageDefinition() {
    return kept<ros::message_traits::Definition<Message>>();
  }
  const std::string& __getMD5Sum() const { return __s_getMD5Sum(); }
  const std::string& __getDataType() const { return __s_getDataType(); }
  const std::string& __getMessageDefinition() const { return __s_getMessageDefinition(); }

 private:
  template <typename Trait>
  static const std::string& kept() {
    static const std::string value = Trait::value();
    return value;
  }
};

/// An array of a streamed message. @tparam Content has count(), the bytes() of all elements, and write(to).
template <typename Content>
struct StreamedArray : Content {
  using Content::Content;
};

}  // namespace bki_mapping::ros_interface

namespace ros {
namespace serialization {

template <typename Fields>
struct Serializer<bki_mapping::ros_interface::StreamedMessage<Fields>> {
  using Message = bki_mapping::ros_interface::StreamedMessage<Fields>;

  static void write(OStream& stream, const Message& message) {
    message.visitMembers([&stream](const auto&... members) { (stream.next(members), ...); });
  }
  static std::uint32_t serializedLength(const Message& message) {
    std::uint32_t length = 0;
    message.visitMembers(
        [&length](const auto&... members) { ((length += serializationLength(members)), ...); });
    return length;
  }
};

template <typename Content>
struct Serializer<bki_mapping::ros_interface::StreamedArray<Content>> {
  using Array = bki_mapping::ros_interface::StreamedArray<Content>;

  static void write(OStream& stream, const Array& array) {
    stream.next(array.count());
    std::uint8_t* const to = stream.advance(array.bytes());
    bki_mapping::ros_interface::useLargePages(to, array.bytes());
    array.write(to);
  }
  static std::uint32_t serializedLength(const Array& array) {
    return static_cast<std::uint32_t>(sizeof(std::uint32_t)) + array.bytes();
  }
};

}  // namespace serialization
}  // namespace ros
