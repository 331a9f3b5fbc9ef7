/// @file Named parameters: one description of each setting for files, command lines, ROS and the documents.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
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

/// How a setting of a struct `Config` is read and written. Values are text as YAML writes it. The functions
/// get the setting's facts, which say what is allowed.
template <typename Config>
class ParameterAccess {
 public:
  using Facts = ParameterFacts;
  virtual ~ParameterAccess() = default;
  /// Sets the value; false, with `config` unchanged, if it is not allowed.
  virtual bool assign(const Facts& facts, Config& config, const std::string& value) const = 0;
  virtual std::string get(const Facts& facts, const Config& config) const = 0;
  /// Whether the value in `config` is allowed.
  virtual bool allowed(const Facts& facts, const Config& config) const = 0;
  /// Whether both values are the same to the bit.
  virtual bool equal(const Config& a, const Config& b) const = 0;
};

/// One named setting of a struct `Config`.
template <typename Config>
struct NamedParameter : ParameterFacts {
  std::shared_ptr<const ParameterAccess<Config>> access;

  bool assign(Config& config, const std::string& value) const { return access->assign(*this, config, value); }
  std::string get(const Config& config) const { return access->get(*this, config); }
  bool allowed(const Config& config) const { return access->allowed(*this, config); }
  bool equal(const Config& a, const Config& b) const { return access->equal(a, b); }

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

/// The facts of a number. @param kind kReal or kInteger.
ParameterFacts numberFacts(std::string_view name, ParameterType kind, const NumberRange& range,
                           std::string_view unit, Changes changes, std::string_view description);
/// The facts of a choice between words.
ParameterFacts wordFacts(std::string_view name, const std::vector<std::string>& words, Changes changes,
                         std::string_view description);
/// The facts of a text. @param values what the text means.
ParameterFacts textFacts(std::string_view name, std::string_view values, Changes changes,
                         std::string_view description);

/// The access to a member. Kind has `Value`, the type of the member, and functions of facts: `parse` of text,
/// which has no value if the text spells no allowed value; `print`; and `allows`.
template <typename Config, typename Kind>
class MemberAccess : public ParameterAccess<Config> {
 public:
  using Value = typename Kind::Value;
  using Facts = ParameterFacts;
  explicit MemberAccess(Value Config::*field) : field_(field) {}

  bool assign(const Facts& facts, Config& config, const std::string& text) const override {
    const std::optional<Value> value = Kind::parse(facts, text);
    if (value) config.*field_ = *value;
    return value.has_value();
  }
  std::string get(const Facts& facts, const Config& config) const override {
    return Kind::print(facts, config.*field_);
  }
  bool allowed(const Facts& facts, const Config& config) const override {
    return Kind::allows(facts, config.*field_);
  }
  bool equal(const Config& a, const Config& b) const override { return a.*field_ == b.*field_; }

 private:
  Value Config::*field_;
};

/// The member `field` as a parameter.
template <typename Kind, typename Config>
NamedParameter<Config> memberParameter(const ParameterFacts& facts, typename Kind::Value Config::*field) {
  return {facts, std::make_shared<MemberAccess<Config, Kind>>(field)};
}

/// The kinds of values, for MemberAccess.
namespace kinds {

struct Real {
  using Value = double;
  static std::optional<double> parse(const ParameterFacts& facts, const std::string& text);
  static std::string print(const ParameterFacts&, double value) { return numberText(value); }
  static bool allows(const ParameterFacts& facts, double value) { return facts.range.allows(value); }
};

template <typename Integer>
struct Whole {
  using Value = Integer;
  static std::optional<Value> parse(const ParameterFacts& facts, const std::string& text) {
    const std::optional<double> number = Real::parse(facts, text);
    const bool allowed = number && *number == std::floor(*number);
    return allowed ? std::optional(static_cast<Value>(*number)) : std::nullopt;
  }
  static std::string print(const ParameterFacts&, Value value) { return std::to_string(value); }
  static bool allows(const ParameterFacts& facts, Value value) {
    return facts.range.allows(static_cast<double>(value));
  }
};

template <typename Enumeration>
struct Choice {
  using Value = Enumeration;
  static std::optional<Value> parse(const ParameterFacts& facts, const std::string& text) {
    const std::optional<std::size_t> index = indexOf(facts.words, text);
    return index ? std::optional(static_cast<Value>(*index)) : std::nullopt;
  }
  static std::string print(const ParameterFacts& facts, Value value) {
    const auto index = static_cast<std::size_t>(value);
    return index < facts.words.size() ? facts.words[index] : std::to_string(index);
  }
  static bool allows(const ParameterFacts& facts, Value value) {
    return static_cast<std::size_t>(value) < facts.words.size();
  }
};

struct Text {
  using Value = std::string;
  static std::optional<std::string> parse(const ParameterFacts&, const std::string& text) { return text; }
  static std::string print(const ParameterFacts&, const std::string& text) { return text; }
  static bool allows(const ParameterFacts&, const std::string&) { return true; }
};

struct Word : Text {
  static std::optional<std::string> parse(const ParameterFacts& facts, const std::string& text) {
    return allows(facts, text) ? std::optional(text) : std::nullopt;
  }
  static bool allows(const ParameterFacts& facts, const std::string& text) {
    return indexOf(facts.words, text).has_value();
  }
};

}  // namespace kinds

template <typename Config>
NamedParameter<Config> realParameter(std::string_view name, double Config::*field, const NumberRange& range,
                                     std::string_view unit, Changes changes, std::string_view description) {
  return memberParameter<kinds::Real>(
      numberFacts(name, ParameterType::kReal, range, unit, changes, description), field);
}

/// @param range of integers that both Value and double represent exactly.
template <typename Config, typename Value>
NamedParameter<Config> integerParameter(std::string_view name, Value Config::*field, const NumberRange& range,
                                        Changes changes, std::string_view description) {
  return memberParameter<kinds::Whole<Value>>(
      numberFacts(name, ParameterType::kInteger, range, "", changes, description), field);
}

/// A choice between words. @param words in the order of the enumeration Value, or of false and true.
template <typename Config, typename Value>
NamedParameter<Config> choiceParameter(std::string_view name, Value Config::*field,
                                       const std::vector<std::string>& words, Changes changes,
                                       std::string_view description) {
  return memberParameter<kinds::Choice<Value>>(wordFacts(name, words, changes, description), field);
}

template <typename Config>
NamedParameter<Config> truthParameter(std::string_view name, bool Config::*field, Changes changes,
                                      std::string_view description) {
  NamedParameter<Config> parameter = choiceParameter(name, field, {"false", "true"}, changes, description);
  parameter.type = ParameterType::kTruth;
  return parameter;
}

/// A choice between words that is stored as text.
template <typename Config>
NamedParameter<Config> wordParameter(std::string_view name, std::string Config::*field,
                                     const std::vector<std::string>& words, Changes changes,
                                     std::string_view description) {
  return memberParameter<kinds::Word>(wordFacts(name, words, changes, description), field);
}

/// Any text. @param values what the text means.
template <typename Config>
NamedParameter<Config> textParameter(std::string_view name, std::string Config::*field,
                                     std::string_view values, Changes changes, std::string_view description) {
  return memberParameter<kinds::Text>(textFacts(name, values, changes, description), field);
}

/// The access to a setting of the member `part`.
template <typename Config, typename Part>
class PartAccess : public ParameterAccess<Config> {
 public:
  using Facts = ParameterFacts;
  PartAccess(Part Config::*part, std::shared_ptr<const ParameterAccess<Part>> of_part)
      : part_(part), of_part_(std::move(of_part)) {}

  bool assign(const Facts& facts, Config& config, const std::string& text) const override {
    return of_part_->assign(facts, config.*part_, text);
  }
  std::string get(const Facts& facts, const Config& config) const override {
    return of_part_->get(facts, config.*part_);
  }
  bool allowed(const Facts& facts, const Config& config) const override {
    return of_part_->allowed(facts, config.*part_);
  }
  bool equal(const Config& a, const Config& b) const override { return of_part_->equal(a.*part_, b.*part_); }

 private:
  Part Config::*part_;
  std::shared_ptr<const ParameterAccess<Part>> of_part_;
};

/// Appends the parameters of the member `part`. @param prefix of their names.
template <typename Config, typename Part>
void appendParameters(std::vector<NamedParameter<Config>>& parameters, const std::string& prefix,
                      Part Config::*part, const std::vector<NamedParameter<Part>>& of_part) {
  for (const NamedParameter<Part>& p : of_part) {
    ParameterFacts facts = p;
    facts.name = prefix + p.name;
    parameters.push_back({facts, std::make_shared<PartAccess<Config, Part>>(part, p.access)});
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
