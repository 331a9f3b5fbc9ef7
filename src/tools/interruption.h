/// @file Ends programs by signals, without losing their work.
#pragma once

#include <csignal>
#include <stdexcept>
#include <vector>

namespace bki_mapping::tools {

/// Exit status of a program that a signal ended early, as shells report it for SIGINT.
constexpr int kStoppedStatus = 130;

/// Ends a program early; run() makes it one line on standard error and kStoppedStatus.
class Stopped : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// While it exists, the first SIGINT or SIGTERM is only noted, so that the program can end at a good place,
/// and the second one ends the process at once. Signals that the program has been started to ignore, as by
/// nohup, stay ignored. There is at most one at a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  /// Whether a signal has come.
  bool requested() const;

 private:
  std::vector<int> signals_;  ///< those that are noted
};

}  // namespace bki_mapping::tools
