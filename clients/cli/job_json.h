/// Reads the server's responses about a job: missing and null members become neutral values. Checks
/// the JSON that users write.
#pragma once

#include <string>

#include "clients/cli/job_flags.h"
#include "clients/cli/progress.h"

namespace cli {

/// Returns "is nested deeper than ..." for JSON that is nested deeper than any request may be,
/// which is neither copied nor written, since both recur; else empty, also for text that is no
/// JSON.
std::string nesting_fault(const std::string& text);
/// Never throws: invalid JSON gives an empty object.
Json parse_object(const std::string& text);
/// Return a member as text, number or object; fallback if it is absent, null or of another type.
std::string text_at(const Json& object, const char* key, const std::string& fallback = "");
double number_at(const Json& object, const char* key, double fallback);
const Json& object_in(const Json& object, const char* key);

/// Returns true for finished, failed and cancelled.
bool is_final_state(const std::string& state);
/// Reads a job, or a progress event: {"state", "progress", "error", "statistics"}.
ProgressFacts facts_of(const Json& job);
/// Returns one sentence about a job that has ended.
std::string closing_text(const Json& job);
/// Returns the exit code for a job: 0 if finished, otherwise 1.
int exit_code_of(const Json& job);

}  // namespace cli
