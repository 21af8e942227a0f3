/// Reading the server's answers about a job: missing and null members become neutral values.
#pragma once

#include <string>

#include "clients/cli/job_flags.h"
#include "clients/cli/progress.h"

namespace cli {

/// Never throws: broken JSON is an empty object.
Json parse_object(const std::string& text);
/// Member as text, number or object; fallback when it is absent, null or of another type.
std::string text_at(const Json& object, const char* key, const std::string& fallback = "");
double number_at(const Json& object, const char* key, double fallback);
const Json& object_in(const Json& object, const char* key);

/// finished, failed or cancelled.
bool is_final_state(const std::string& state);
/// From a job, or from a progress event: {"state", "progress", "error", "statistics"}.
ProgressFacts facts_of(const Json& job);
/// One sentence about a job that has ended.
std::string closing_text(const Json& job);
/// {"job": job}'s exit code: 0 finished, else 1.
int exit_code_of(const Json& job);

}  // namespace cli
