/// @file How long a scan takes: by the clock, and on the processor.
#pragma once

#include <ctime>
#include <vector>

#include "core/quantile.h"
#include "core/stopwatch.h"

namespace bki_mapping {

/// Processor time is that of all threads of the process. On a busy machine, it is the fairer of the two for
/// what runs on one thread: the longer something takes, the surer other processes interrupt it.
struct ScanTime {
  double wall = 0.0, processor = 0.0;  ///< [ms]
};

class ScanTimer {
 public:
  /// The time since construction.
  ScanTime elapsed() {
    const double processor = 1e3 * static_cast<double>(std::clock() - start_) / CLOCKS_PER_SEC;
    return {watch_.lap(), processor};
  }

 private:
  Stopwatch watch_;
  std::clock_t start_ = std::clock();
};

/// Times of the scans of a drive [ms].
struct ScanTimes {
  std::vector<double> wall, processor;
  void add(const ScanTime& time) {
    wall.push_back(time.wall);
    processor.push_back(time.processor);
  }
  ScanTime median() const { return {quantile(wall, 0.5), quantile(processor, 0.5)}; }
};

}  // namespace bki_mapping
