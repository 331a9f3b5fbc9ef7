/// @file Prints the properties of all parameters as JSON, for scripts/generate_parameters.
#include <algorithm>
#include <iostream>

#include "bki_mapping/mapping/mapper_config.h"
#include "export/ordered_json.h"
#include "ros/live_settings.h"
#include "ros/server_config.h"

namespace bki_mapping {
namespace {

using Json = OrderedJson;

const char* nameOf(ParameterType type) {
  switch (type) {
    case ParameterType::kReal:
      return "real";
    case ParameterType::kInteger:
      return "integer";
    case ParameterType::kTruth:
      return "truth";
    case ParameterType::kWord:
      return "word";
    default:
      return "text";
  }
}

/// Numbers are strings, formatted as in parameter files.
template <typename Config>
Json jsonOf(const std::vector<NamedParameter<Config>>& parameters) {
  const std::vector<std::string>& shown = ros_interface::shownAtStart();
  Json list = Json::array();
  for (const auto& p : parameters) {
    Json facts = {{"name", p.name},
                  {"type", nameOf(p.type)},
                  {"default", p.get(Config())},
                  {"unit", p.unit},
                  {"values", p.values},
                  {"words", p.words},
                  {"changes_while_mapping", p.changesWhileMapping()},
                  {"shown_while_mapping", p.changesWhileMapping() || indexOf(shown, p.name).has_value()},
                  {"description", p.description}};
    if (p.type == ParameterType::kReal || p.type == ParameterType::kInteger) {
      facts["slider"] = {numberText(p.range.sliderLeast()), numberText(p.range.sliderMost())};
    }
    list.push_back(facts);
  }
  return list;
}

}  // namespace
}  // namespace bki_mapping

int main() {
  using namespace bki_mapping;
  std::cout << Json{{"mapper", jsonOf(mapperParameters())},
                    {"node", jsonOf(ros_interface::serverParameters())},
                    {"inputs", jsonOf(ros_interface::inputParameters())},
                    {"refusal", ros_interface::kLastRefusal}}
                   .dump(2)
            << "\n";
  return std::cout.good() ? 0 : 1;
}
