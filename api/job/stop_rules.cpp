#include "api/job/stop_rules.h"

#include <array>
#include <span>

#include "api/job/job_spec.h"
#include "api/json/fields.h"
#include "api/json/limits.h"
#include "api/json/time_text.h"
#include "core/settings/choices.h"
#include "core/settings/sample_sets.h"

namespace api {
namespace {

using core::StopRules;

constexpr double kConfidence = 0.95;

constexpr std::array kErrorScopes = {
    core::NamedValue<bool>{"image", false, "The error of the whole image."},
    core::NamedValue<bool>{"worst_tile", true, "The error of the worst tile."},
};
std::span<const core::NamedValue<bool>> scopes() { return kErrorScopes; }

void read_deadline(const Json& value, StopRules& rules, const std::string& pointer,
                   Faults& faults) {
  rules.deadline_unix_seconds.reset();
  if (value.is_null()) {
    return;
  }
  const auto text = read_text(value, {1, 64}, pointer, faults);
  if (!text) {
    return;
  }
  rules.deadline_unix_seconds = parse_rfc3339(*text);
  if (!rules.deadline_unix_seconds) {
    faults.add(pointer, shown(value) + " is not an RFC 3339 time such as 2026-01-31T12:00:00Z");
  }
}

const auto& table() {
  static constexpr auto kTable = std::tuple{
      shown_if(
          [](const StopRules& s) { return s.samples_per_pixel.has_value(); },
          number("samples_per_pixel", &StopRules::samples_per_pixel, {1, limits::kSamplesPerPixel},
                 "Stop at this mean number of samples per pixel of the crop, all replicates "
                 "together. Rounded up to a count that the sampler supports.")),
      shown_if([](const StopRules& s) { return s.relative_error.has_value(); },
               number("relative_error", &StopRules::relative_error,
                      {limits::kRelativeErrorMin, limits::kRelativeErrorMax},
                      "Stop when the relative error is at most this, with `confidence`.")),
      shown_if(
          [](const StopRules& s) { return s.denoised_error.has_value(); },
          number(
              "denoised_error", &StopRules::denoised_error,
              {limits::kRelativeErrorMin, limits::kRelativeErrorMax},
              "Stop when the relative error of the denoised image (`mixed`) is at most this, with "
              "`confidence`. The image is denoised at 4, 6, 8, 12, 16 ... samples to check.")),
      shown_if(
          [](const StopRules& s) {
            return s.relative_error || s.denoised_error || s.light_not_found ||
                   s.confidence != kConfidence;
          },
          number(
              "confidence", &StopRules::confidence, {0.5, 0.9999},
              "Confidence of relative_error, denoised_error, light_not_found and of the interval "
              "in `error`.")),
      shown_if([](const StopRules& s) { return s.relative_error.has_value(); },
               when([](const StopRules& s) { return s.relative_error.has_value(); },
                    "applies only to relative_error",
                    choice("scope", &StopRules::worst_tile, &scopes,
                           "Region whose error must reach the target."))),
      shown_if([](const StopRules& s) { return s.seconds.has_value(); },
               number("seconds", &StopRules::seconds, {0, limits::kStopSeconds, true},
                      "Stop after this many seconds of rendering, without pauses and downtime.")),
      shown_if([](const StopRules& s) { return s.cpu_seconds.has_value(); },
               number("cpu_seconds", &StopRules::cpu_seconds, {0, limits::kStopCpuSeconds, true},
                      "Stop after this many CPU seconds of rendering, summed over all threads.")),
      shown_if(
          [](const StopRules& s) { return s.meter_error.has_value(); },
          number("meter_error", &StopRules::meter_error,
                 {limits::kRelativeErrorMin, limits::kRelativeErrorMax},
                 "Stop when (high - low) / illuminance_lux of every point of the meter is at most "
                 "this.")),
      shown_if(
          [](const StopRules& s) { return s.light_not_found.has_value(); },
          number("light_not_found", &StopRules::light_not_found,
                 {limits::kRelativeErrorMin, limits::kRelativeErrorMax},
                 "Stop when `light_not_found.at_most` is at most this, with `confidence`. Beside "
                 "relative_error, denoised_error or meter_error: these end the job only then.")),
      CustomRow<StopRules>{"deadline", &read_deadline,
                           [](const StopRules& s, Json& object) {
                             if (s.deadline_unix_seconds) {
                               object["deadline"] = short_rfc3339(*s.deadline_unix_seconds);
                             }
                           },
                           [](const StopRules& /*defaults*/) {
                             Json schema =
                                 basic_schema("string", "Stop at this time (RFC 3339).", true);
                             schema["format"] = "date-time";
                             return schema;
                           },
                           false, true},
  };
  return kTable;
}

}  // namespace

StopRules read_stop(const Json& value, const std::string& pointer, Faults& faults) {
  StopRules rules;
  Faults inner;
  read_members(table(), value, rules, pointer, inner);
  if (!inner.empty()) {
    faults.append(inner);
    return rules;
  }
  if (!rules.samples_per_pixel && !rules.relative_error && !rules.denoised_error &&
      !rules.light_not_found && !rules.seconds && !rules.cpu_seconds &&
      !rules.deadline_unix_seconds && !rules.meter_error) {
    faults.add(pointer,
               "has no rule; give samples_per_pixel, relative_error, denoised_error, meter_error, "
               "light_not_found, seconds, cpu_seconds or deadline");
  }
  return rules;
}

Json print_stop(const StopRules& rules) { return print_members(table(), rules); }

Json stop_schema(const StopRules& defaults) {
  Json schema = object_schema(
      table(), defaults,
      "When to stop: the first rule met ends the job. If given, only the rules in it apply.");
  // Only the description says that a rule is required: generators of clients lose the type at an
  // anyOf.
  schema["minProperties"] = 1;
  schema["default"] = print_stop(defaults);
  return schema;
}

std::vector<std::string_view> stop_member_names() { return member_names(table()); }

void round_stop(StopRules& rules, const core::RenderSettings& settings,
                std::vector<std::string>& warnings) {
  if (!rules.samples_per_pixel) {
    return;
  }
  const int asked = *rules.samples_per_pixel;
  int in_force = core::rounded_samples(settings, asked);
  if (in_force > limits::kSamplesPerPixel) {  // rounds down to the largest allowed count
    in_force -= core::sample_unit(settings);
  }
  if (in_force == asked) {
    return;
  }
  const std::string_view sampler = core::row_of(core::samplers(), settings.sampler).name;
  const std::string history = core::shared_window(settings) > 1
                                  ? "history " + std::to_string(settings.light_history) + " and "
                                  : "";
  const std::string why = "sampler '" + std::string(sampler) + "' with " + history +
                          std::to_string(settings.replicates) + " replicates rounds " +
                          std::to_string(asked) + " to " + std::to_string(in_force);
  rules.samples_per_pixel = in_force;
  warnings.push_back(std::string(kSamplesWarning) + std::to_string(asked) + " was requested, " +
                     std::to_string(in_force) + " is used: " + why + ".");
}

}  // namespace api
