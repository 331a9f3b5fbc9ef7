/// @file Elapsed wall time.
#pragma once

#include <chrono>

namespace bki_mapping {

class Stopwatch {
 public:
  /// Milliseconds since construction or the last lap().
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const std::chrono::duration<double, std::milli> elapsed = now - last_;
    last_ = now;
    return elapsed.count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace bki_mapping
