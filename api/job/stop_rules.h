/// The `stop` object: shared by the job request, its patch, and `extend`.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/json/faults.h"
#include "api/json/json.h"
#include "core/settings/settings.h"

namespace api {

/// Reads the rules into an empty StopRules. A `stop` without a rule is a fault.
core::StopRules read_stop(const Json& value, const std::string& pointer, Faults& faults);
/// Prints only the rules that are set; confidence and scope where they apply.
Json print_stop(const core::StopRules& rules);
Json stop_schema(const core::StopRules& defaults);
std::vector<std::string_view> stop_member_names();

/// Rounds samples_per_pixel up by the sampler's rule, or down if that exceeded the limit; a warning
/// reports the requested and the effective count.
void round_stop(core::StopRules& rules, const core::RenderSettings& settings,
                std::vector<std::string>& warnings);

}  // namespace api
