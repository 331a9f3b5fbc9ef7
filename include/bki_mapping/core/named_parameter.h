/// @file Named parameters: one description of each setting for files, command lines, ROS and the documents.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace bki_mapping {

/// The largest evidence, gain or kernel value that a parameter allows. Larger ones could overflow a float.
constexpr double kMostEvidence = 1e9;

/// The values that a numeric parameter allows. Infinity and NaN are never allowed.
class NumberRange {
 public:
  static NumberRange any() { return {}; }
  static NumberRange atLeast(double least);
  static NumberRange above(double least);  ///< `least` itself is not allowed
  /// This range with an upper limit.
  NumberRange upTo(double most) const;
  /// This range and one more value. @param meaning of that value; "" if the description gives it.
  NumberRange orElse(double value, const std::string& meaning = "") const;
  /// This range with narrower limits for sliders.
  NumberRange slider(double least, double most) const;

  bool allows(double value) const;
  /// The range in words. @param kind "a number" or "an integer".
  std::string text(const std::string& kind) const;
  double sliderLeast() const { return slider_least_.value_or(least_); }
  double sliderMost() const { return slider_most_.value_or(most_); }

 private:
  double least_ = -std::numeric_limits<double>::infinity(), most_ = std::numeric_limits<double>::infinity();
  bool open_ = false;  ///< least_ is not allowed
  std::optional<double> else_;
  std::string else_meaning_;
  std::optional<double> slider_least_, slider_most_;
};

enum class ParameterType { kReal, kInteger, kTruth, kWord, kText };

/// When a parameter can get another value.
enum class Changes {
  kAtStart,       ///< only before mapping starts
  kWhileMapping,  ///< at any time; the map stays
};

/// What the user interfaces show of a parameter.
struct ParameterFacts {
  std::string name;  ///< with `/` between the parts, as in ROS
  ParameterType type = ParameterType::kText;
  std::string values;       ///< the values allowed, in words
  std::string unit;         ///< "" if it has none
  std::string description;  ///< what it does, and what to set it to
  Changes changes = Changes::kAtStart;
  std::vector<std::string> words;  ///< the values of a kWord or kTruth
  NumberRange range;               ///< the values of a kReal or kInteger

  bool changesWhileMapping() const { return changes == Changes::kWhileMapping; }
};

/// @throws std::invalid_argument that names the parameter, the value, the allowed values and the closest
/// word among them.
[[noreturn]] void refuseValue(const ParameterFacts& parameter, const std::string& value);

/// @throws std::invalid_argument that says that the parameter can change only at the start.
[[noreturn]] void refuseChange(const ParameterFacts& parameter);

/// One named setting of a struct `Config`. Values are text as YAML writes it.
template <typename Config>
struct NamedParameter : ParameterFacts {
  /// Sets the value; false, with `config` unchanged, if it is not allowed.
  std::function<bool(Config&, const std::string& value)> assign;
  std::function<std::string(const Config&)> get;
  std::function<bool(const Config&)> allowed;               ///< whether the value in a Config is allowed
  std::function<bool(const Config&, const Config&)> equal;  ///< whether both values are the same to the bit

  /// Sets the value. @throws std::invalid_argument (refuseValue).
  void set(Config& config, const std::string& value) const {
    if (!assign(config, value)) refuseValue(*this, value);
  }
  /// Checks the value in `config`. @throws std::invalid_argument (refuseValue).
  void check(const Config& config) const {
    if (!allowed(config)) refuseValue(*this, get(config));
  }
};

/// "; did you mean 'X'?" for the known word closest in spelling; "" if none is close.
std::string nearestWord(const std::string& word, const std::vector<std::string>& known);

/// "one of X, Y", or "true or false".
std::string wordsText(const std::vector<std::string>& words);
/// The position of `word` in `words`; no value if it is missing.
std::optional<std::size_t> indexOf(const std::vector<std::string>& words, const std::string& word);

/// The shortest text of a number that keeps 15 digits; integers up to 2^53 keep all of theirs.
std::string numberText(double value);
/// The number that the whole text spells; NaN if it spells none.
double parseNumber(const std::string& text);

/// Makes text of unknown origin safe to quote in a message: it is cut after `most` bytes, so that it cannot
/// flood a log, and control characters become '?', so that they cannot reach a terminal.
std::string shortText(const std::string& text, std::size_t most = 100);

/// The member `field` as a parameter.
/// @param parse std::optional<Value>(text), without a value if the text spells no allowed value.
/// @param print text(Value). @param allows bool(Value).
template <typename Config, typename Value, typename Parse, typename Print, typename Allows>
NamedParameter<Config> memberParameter(ParameterFacts facts, Value Config::*field, Parse parse, Print print,
                                       Allows allows) {
  const auto assign = [=](Config& config, const std::string& text) {
    const std::optional<Value> value = parse(text);
    if (value) config.*field = *value;
    return value.has_value();
  };
  return {std::move(facts), assign, [=](const Config& config) { return print(config.*field); },
          [=](const Config& config) { return allows(config.*field); },
          [=](const Config& a, const Config& b) { return a.*field == b.*field; }};
}

template <typename Config>
NamedParameter<Config> realParameter(const std::string& name, double Config::*field, const NumberRange& range,
                                     const std::string& unit, Changes changes,
                                     const std::string& description) {
  const auto allows = [=](double value) { return range.allows(value); };
  const auto parse = [=](const std::string& text) {
    const double number = parseNumber(text);
    return allows(number) ? std::optional(number) : std::nullopt;
  };
  const std::string values = range.text("a number");
  return memberParameter<Config>({name, ParameterType::kReal, values, unit, description, changes, {}, range},
                                 field, parse, numberText, allows);
}

/// @param range of integers that both Value and double represent exactly.
template <typename Config, typename Value>
NamedParameter<Config> integerParameter(const std::string& name, Value Config::*field,
                                        const NumberRange& range, Changes changes,
                                        const std::string& description) {
  const auto allows = [=](Value value) { return range.allows(static_cast<double>(value)); };
  const auto parse = [=](const std::string& text) {
    const double number = parseNumber(text);
    const bool allowed = range.allows(number) && number == std::floor(number);
    return allowed ? std::optional(static_cast<Value>(number)) : std::nullopt;
  };
  const auto print = [](Value value) { return std::to_string(value); };
  const std::string values = range.text("an integer");
  return memberParameter<Config>({name, ParameterType::kInteger, values, "", description, changes, {}, range},
                                 field, parse, print, allows);
}

/// A choice between words. @param words in the order of the enumeration Value, or of false and true.
template <typename Config, typename Value>
NamedParameter<Config> choiceParameter(const std::string& name, Value Config::*field,
                                       const std::vector<std::string>& words, Changes changes,
                                       const std::string& description) {
  const auto allows = [=](Value value) { return static_cast<std::size_t>(value) < words.size(); };
  const auto parse = [=](const std::string& text) {
    const std::optional<std::size_t> index = indexOf(words, text);
    return index ? std::optional(static_cast<Value>(*index)) : std::nullopt;
  };
  const auto print = [=](Value value) {
    const auto index = static_cast<std::size_t>(value);
    return index < words.size() ? words[index] : std::to_string(index);
  };
  const std::string values = wordsText(words);
  return memberParameter<Config>({name, ParameterType::kWord, values, "", description, changes, words, {}},
                                 field, parse, print, allows);
}

template <typename Config>
NamedParameter<Config> truthParameter(const std::string& name, bool Config::*field, Changes changes,
                                      const std::string& description) {
  NamedParameter<Config> parameter = choiceParameter(name, field, {"false", "true"}, changes, description);
  parameter.type = ParameterType::kTruth;
  return parameter;
}

/// A choice between words that is stored as text.
template <typename Config>
NamedParameter<Config> wordParameter(const std::string& name, std::string Config::*field,
                                     const std::vector<std::string>& words, Changes changes,
                                     const std::string& description) {
  const auto allows = [=](const std::string& text) { return indexOf(words, text).has_value(); };
  const auto parse = [=](const std::string& text) {
    return allows(text) ? std::optional(text) : std::nullopt;
  };
  const auto print = [](const std::string& text) { return text; };
  const std::string values = wordsText(words);
  return memberParameter<Config>({name, ParameterType::kWord, values, "", description, changes, words, {}},
                                 field, parse, print, allows);
}

/// Any text. @param values what the text means.
template <typename Config>
NamedParameter<Config> textParameter(const std::string& name, std::string Config::*field,
                                     const std::string& values, Changes changes,
                                     const std::string& description) {
  const auto same = [](const std::string& text) { return text; };
  const auto parse = [](const std::string& text) { return std::optional(text); };
  return memberParameter<Config>({name, ParameterType::kText, values, "", description, changes, {}, {}},
                                 field, parse, same, [](const std::string&) { return true; });
}

/// Appends the parameters of the member `part`. @param prefix of their names.
template <typename Config, typename Part>
void appendParameters(std::vector<NamedParameter<Config>>& parameters, const std::string& prefix,
                      Part Config::*part, const std::vector<NamedParameter<Part>>& of_part) {
  for (const NamedParameter<Part>& p : of_part) {
    ParameterFacts facts = p;
    facts.name = prefix + p.name;
    parameters.push_back(
        {facts, [=](Config& config, const std::string& text) { return p.assign(config.*part, text); },
         [=](const Config& config) { return p.get(config.*part); },
         [=](const Config& config) { return p.allowed(config.*part); },
         [=](const Config& a, const Config& b) { return p.equal(a.*part, b.*part); }});
  }
}

/// Sets several parameters at once.
/// @throws std::invalid_argument that lists every unknown name (with the nearest known one) and every value
/// that is not allowed; `config` is then unchanged.
template <typename Config>
void setNamedParameters(const std::vector<NamedParameter<Config>>& parameters, Config& config,
                        const std::map<std::string, std::string>& values) {
  std::vector<std::string> names;
  for (const auto& p : parameters) names.push_back(p.name);
  Config changed = config;
  std::string faults;
  for (const auto& [name, value] : values) {
    try {
      const std::optional<std::size_t> index = indexOf(names, name);
      if (!index)
        throw std::invalid_argument("parameter '" + name + "' is unknown" + nearestWord(name, names));
      parameters[*index].set(changed, value);
    } catch (const std::invalid_argument& fault) {
      faults += (faults.empty() ? "" : "; ") + std::string(fault.what());
    }
  }
  if (!faults.empty()) throw std::invalid_argument(faults);
  config = changed;
}

/// @throws std::invalid_argument that lists every value in `config` that is not allowed.
template <typename Config>
void checkNamedParameters(const std::vector<NamedParameter<Config>>& parameters, const Config& config) {
  std::string faults;
  for (const auto& p : parameters) {
    try {
      p.check(config);
    } catch (const std::invalid_argument& fault) {
      faults += (faults.empty() ? "" : "; ") + std::string(fault.what());
    }
  }
  if (!faults.empty()) throw std::invalid_argument(faults);
}

}  // namespace bki_mapping
