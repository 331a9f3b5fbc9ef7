/// @file The exception for a scan that was not added to the map.
#pragma once

#include <stdexcept>
#include <string>

namespace bki_mapping {

/// A scan was refused; what() says why and what to do. The map is as it was before the scan.
class ScanRefused : public std::runtime_error {
 public:
  enum class Reason {
    kTooLarge,  ///< it would touch more blocks, or take more samples, than the limits allow
    kMemory,    ///< it would exceed memory_limit or the computer's memory
  };

  ScanRefused(Reason reason, const std::string& sentence) : std::runtime_error(sentence), reason_(reason) {}
  Reason reason() const { return reason_; }

 private:
  Reason reason_;
};

}  // namespace bki_mapping
