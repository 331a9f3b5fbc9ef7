#include "ros/new_drive.h"

#include <ctime>
#include <fstream>
#include <stdexcept>

namespace bki_mapping::ros_interface {
namespace {

/// An id that no other drive of any robot has: a random UUID from the kernel.
std::string newId() {
  std::string id;
  std::ifstream("/proc/sys/kernel/random/uuid") >> id;
  if (id.empty()) throw std::runtime_error("/proc/sys/kernel/random/uuid gives no id for the drive");
  return id;
}

std::string utcText() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[sizeof "2000-01-01T00:00:00Z"];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

}  // namespace

DriveRecord newDrive(const std::string& name) {
  DriveRecord drive;
  drive.id = newId();
  drive.name = name + " " + utcText();
  return drive;
}

}  // namespace bki_mapping::ros_interface
