/// The `stop` object: shared by the job request, its patch, and `extend`.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "api/faults.h"
#include "api/json.h"
#include "core/settings/settings.h"

namespace api {

/// Reads into rules that say nothing yet. A `stop` without a rule is a fault.
core::StopRules read_stop(const Json& value, const std::string& pointer, Faults& faults);
/// Only the rules that are there; confidence and scope where they matter.
Json print_stop(const core::StopRules& rules);
Json stop_schema(const core::StopRules& defaults);
std::vector<std::string_view> stop_member_names();

/// Rounds samples_per_pixel by the sampler's rule, up, or down where that would be more than a job
/// may have; a warning says what was asked and what is in force.
void round_stop(core::StopRules& rules, const core::RenderSettings& settings,
                std::vector<std::string>& warnings);

}  // namespace api
