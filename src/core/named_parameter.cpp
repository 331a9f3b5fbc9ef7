#include "bki_mapping/core/named_parameter.h"

#include <algorithm>
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

}  // namespace

std::string numberText(double value) {
  std::ostringstream out;
  out.precision(std::numeric_limits<double>::digits10);
  out << value;
  return out.str();
}

double parseNumber(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  const bool whole = !text.empty() && *end == '\0';
  return whole ? number : std::numeric_limits<double>::quiet_NaN();
}

std::string shortText(const std::string& text, std::size_t most) {
  std::string out = text.size() > most ? text.substr(0, most) + "..." : text;
  std::replace_if(
      out.begin(), out.end(), [](unsigned char c) { return c < 0x20 || c == 0x7f; }, '?');
  return out;
}

void refuseValue(const std::string& name, const std::string& value, const std::string& values) {
  throw std::invalid_argument("parameter " + name + " is '" + shortText(value) + "', but must be " + values);
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
