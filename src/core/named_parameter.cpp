#include "bki_mapping/core/named_parameter.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <sstream>

namespace bki_mapping {
namespace {

std::size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

/// A limit as people write it: "1e9" rather than "1000000000".
std::string limitText(double limit) {
  const std::string digits = numberText(limit);
  const std::size_t last = digits.find_last_not_of('0');
  const std::size_t zeros = digits.size() - 1 - last;
  const bool round = zeros >= 6 && digits.find_first_of(".e") == std::string::npos;
  return round ? digits.substr(0, last + 1) + "e" + std::to_string(zeros) : digits;
}

}  // namespace

NumberRange NumberRange::atLeast(double least) {
  NumberRange range;
  range.least_ = least;
  return range;
}

NumberRange NumberRange::above(double least) {
  NumberRange range = atLeast(least);
  range.open_ = true;
  return range;
}

NumberRange NumberRange::upTo(double most) const {
  NumberRange range = *this;
  range.most_ = most;
  return range;
}

NumberRange NumberRange::orElse(double value, const std::string& meaning) const {
  NumberRange range = *this;
  range.else_ = value;
  range.else_meaning_ = meaning;
  return range;
}

NumberRange NumberRange::slider(double least, double most) const {
  NumberRange range = *this;
  range.slider_least_ = least;
  range.slider_most_ = most;
  return range;
}

bool NumberRange::allows(double value) const {
  if (!std::isfinite(value)) return false;
  if (else_ && value == *else_) return true;
  return (open_ ? value > least_ : value >= least_) && value <= most_;
}

std::string NumberRange::text(const std::string& kind) const {
  std::string text = kind;
  if (open_) {
    text += " > " + limitText(least_) + (std::isfinite(most_) ? ", at most " + limitText(most_) : "");
  } else if (std::isfinite(most_)) {
    text += " from " + limitText(least_) + " to " + limitText(most_);
  } else if (std::isfinite(least_)) {
    text += " >= " + limitText(least_);
  }
  if (!else_) return text;
  return text + ", or " + limitText(*else_) + (else_meaning_.empty() ? "" : " for " + else_meaning_);
}

std::string wordsText(const std::vector<std::string>& words) {
  if (words == std::vector<std::string>{"false", "true"}) return "true or false";
  std::string text = "one of";
  for (const std::string& word : words) text += (&word == &words.front() ? " " : ", ") + word;
  return text;
}

std::optional<std::size_t> indexOf(const std::vector<std::string>& words, const std::string& word) {
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end()) return std::nullopt;
  return static_cast<std::size_t>(found - words.begin());
}

std::string numberText(double value) {
  constexpr double kExact = 1ll << std::numeric_limits<double>::digits;  // all integers below are doubles
  std::ostringstream out;
  const bool integer = std::abs(value) <= kExact && value == std::trunc(value);
  out.precision(integer ? std::numeric_limits<double>::max_digits10 : std::numeric_limits<double>::digits10);
  out << value;
  std::string text = out.str();
  const std::size_t exponent = text.find('e');
  if (exponent != std::string::npos) {  // "1e-6" for "1e-06", "1e20" for "1e+20"
    text.replace(exponent + 1, std::string::npos, std::to_string(std::stoi(text.substr(exponent + 1))));
  }
  return text;
}

double parseNumber(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  const bool is_number = !text.empty() && *end == '\0';
  return is_number ? number : std::numeric_limits<double>::quiet_NaN();
}

std::string shortText(const std::string& text, std::size_t most) {
  std::string out = text.size() > most ? text.substr(0, most) + "..." : text;
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return out;
}

ParameterFacts numberFacts(std::string_view name, ParameterType kind, const NumberRange& range,
                           std::string_view unit, Changes changes, std::string_view description) {
  const std::string values = range.text(kind == ParameterType::kInteger ? "an integer" : "a number");
  return {std::string(name), kind, values, std::string(unit), std::string(description), changes, {}, range};
}

ParameterFacts wordFacts(std::string_view name, const std::vector<std::string>& words, Changes changes,
                         std::string_view description) {
  return {std::string(name),
          ParameterType::kWord,
          wordsText(words),
          "",
          std::string(description),
          changes,
          words,
          {}};
}

ParameterFacts textFacts(std::string_view name, std::string_view values, Changes changes,
                         std::string_view description) {
  return {std::string(name),
          ParameterType::kText,
          std::string(values),
          "",
          std::string(description),
          changes,
          {},
          {}};
}

std::optional<double> kinds::Real::parse(const ParameterFacts& facts, const std::string& text) {
  const double number = parseNumber(text);
  return facts.range.allows(number) ? std::optional(number) : std::nullopt;
}

void refuseValue(const ParameterFacts& parameter, const std::string& value) {
  throw std::invalid_argument("parameter " + parameter.name + " is '" + shortText(value) + "', but must be " +
                              parameter.values + nearestWord(value, parameter.words));
}

void refuseChange(const ParameterFacts& parameter) {
  throw std::invalid_argument("parameter " + parameter.name +
                              " cannot change while mapping; set it and start again");
}

std::string nearestWord(const std::string& word, const std::vector<std::string>& known) {
  std::size_t least = word.size() / 2 + 2;
  std::string nearest;
  for (const std::string& candidate : known) {
    const std::size_t distance = editDistance(word, candidate);
    if (distance < least) {
      least = distance;
      nearest = candidate;
    }
  }
  return nearest.empty() ? "" : "; did you mean '" + nearest + "'?";
}

}  // namespace bki_mapping
