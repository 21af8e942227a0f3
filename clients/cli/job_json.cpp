#include "clients/cli/job_json.h"

#include <limits>
#include <tuple>

#include "api/json/limits.h"
#include "clients/cli/cli.h"

namespace cli {

std::string nesting_fault(const std::string& text) {
  bool is_too_deep = false;
  const auto keep = [&is_too_deep](int depth, Json::parse_event_t event, const Json& /*value*/) {
    const bool begins =
        event == Json::parse_event_t::object_start || event == Json::parse_event_t::array_start;
    is_too_deep = is_too_deep || (begins && depth >= api::limits::kJsonDepth);
    return !is_too_deep;
  };
  std::ignore = Json::parse(text, keep, /*allow_exceptions=*/false);
  return is_too_deep
             ? "is nested deeper than " + std::to_string(api::limits::kJsonDepth) + " levels"
             : "";
}

Json parse_object(const std::string& text) {
  Json json = Json::parse(text, nullptr, false);
  return json.is_object() ? json : Json::object();
}

std::string text_at(const Json& object, const char* key, const std::string& fallback) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : fallback;
}

double number_at(const Json& object, const char* key, double fallback) {
  const auto found = object.find(key);
  return found != object.end() && found->is_number() ? found->get<double>() : fallback;
}

const Json& object_in(const Json& object, const char* key) {
  static const Json kEmpty = Json::object();
  const auto found = object.find(key);
  return found != object.end() && found->is_object() ? *found : kEmpty;
}

bool is_final_state(const std::string& state) {
  return state == "finished" || state == "failed" || state == "cancelled";
}

ProgressFacts facts_of(const Json& job) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  const Json& progress = object_in(job, "progress");
  const Json& error = object_in(job, "error");
  ProgressFacts facts;
  facts.state = text_at(job, "state", "rendering");
  facts.fraction = number_at(progress, "fraction", 0);
  facts.samples_per_pixel = number_at(object_in(progress, "samples_per_pixel"), "mean", 0);
  facts.elapsed_seconds = number_at(progress, "elapsed_seconds", 0);
  facts.relative_error = number_at(error, "relative", kUnknown);
  facts.error_low = number_at(error, "low", kUnknown);
  facts.error_high = number_at(error, "high", kUnknown);
  facts.is_unreliable = error.value("unreliable", Json(false)) == Json(true);
  facts.rays_per_second = number_at(object_in(job, "statistics"), "rays_per_second", 0);
  if (progress.contains("eta_seconds") && progress["eta_seconds"].is_number()) {
    facts.eta_seconds = progress["eta_seconds"].get<double>();
  }
  return facts;
}

std::string closing_text(const Json& job) {
  const ProgressFacts facts = facts_of(job);
  std::string text = facts.state;
  if (const std::string reason = text_at(job, "stop_reason");
      !reason.empty() && reason != facts.state) {
    text += " (" + reason + ")";
  }
  if (facts.state == "failed") {
    const Json& failure = object_in(job, "failure");
    return text + ": " +
           text_at(failure, "detail", text_at(failure, "title", "no reason was given"));
  }
  text += ": " + std::to_string(static_cast<long long>(facts.samples_per_pixel)) + " samples in " +
          duration_text(facts.elapsed_seconds) + " (" +
          duration_text(number_at(object_in(job, "progress"), "cpu_seconds", 0)) +
          " of CPU time), " + interval_text(facts);
  return text;
}

int exit_code_of(const Json& job) { return text_at(job, "state") == "finished" ? kDone : kFailed; }

}  // namespace cli
