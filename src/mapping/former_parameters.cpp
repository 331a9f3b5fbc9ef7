#include "mapping/former_parameters.h"

#include <stdexcept>
#include <utility>

namespace bki_mapping {

void refuseFormerParameters(const std::map<std::string, std::string>& values) {
  constexpr std::pair<const char*, const char*> kFormer[] = {
      {"free_gain/dynamic", "rules/stands_after"},
      {"free_gain/living", "rules/living_stands_after"},
      {"free_gain/static", "rules/enabled"},
      {"free_gain/persistence", "rules/stands_after"},
      {"free_gain/remaining", "rules/enabled"},
      {"free_gain/neighbourhood", "rules/together"},
      {"free_gain/latest", "rules/latest"},
      {"scan_limit/hits", "rules/enabled"},
      {"scan_limit/free", "rules/enabled"},
      {"rules/hit_outweighs", "rules/stands_after"},
      {"scan_limit/free_threshold", "sensor_model/height"},
      {"scan_limit/void", "rules/void_outweighs"},
      {"free_space/hits_before_misses", "rules/enabled"},
      {"free_space/evidence_before_misses", "rules/enabled"},
      {"kernel/static_spread", "rules/enabled"},
  };
  for (const auto& [former, now] : kFormer) {
    if (values.count(former) == 0) continue;
    throw std::invalid_argument("parameter " + std::string(former) + " is no longer one; set " + now +
                                " instead");
  }
}

}  // namespace bki_mapping
