/// @file Limits how often a message is logged.
#pragma once

#include <algorithm>
#include <chrono>
#include <map>
#include <string>

namespace bki_mapping::ros_interface {

/// Lets each sentence through at most once in 5 s. Sentences that differ only in numbers count as the same.
class SentenceThrottle {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kPause{5};
  /// Maximum number of different sentences in that time: a faulty sender must not be able to flood the log.
  static constexpr std::size_t kMax = 64;

  bool allow(const std::string& sentence, Clock::time_point now) {
    std::string key = sentence;
    const auto of_number = [](char c) { return (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '+'; };
    key.erase(std::remove_if(key.begin(), key.end(), of_number), key.end());
    for (auto said = said_.begin(); said != said_.end();) {
      said = now - said->second >= kPause ? said_.erase(said) : std::next(said);
    }
    return said_.size() < kMax && said_.emplace(std::move(key), now).second;
  }

 private:
  std::map<std::string, Clock::time_point> said_;
};

}  // namespace bki_mapping::ros_interface
