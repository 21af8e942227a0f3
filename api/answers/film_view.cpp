#include "api/answers/film_view.h"

#include <nlohmann/json.hpp>

#include "api/answers/views.h"
#include "api/json/errors.h"
#include "api/json/faults.h"
#include "api/json/json.h"
#include "api/json/limits.h"
#include "api/json/time_text.h"
#include "api/json/values.h"

namespace api {
namespace {

constexpr int kVersion = 1;

Json ledger_part(const core::SampleLedger& ledger) {
  Json list = Json::array();
  for (const core::SampleRange& range : ledger) {
    list.push_back({{"seed", range.seed},
                    {"first_replicate", range.first_replicate},
                    {"replicates", range.replicates},
                    {"samples_per_pixel", range.samples}});
  }
  return list;
}

/// Returns the members on which the film's expectation, size and layers depend.
Json picture_part(const JobSpec& spec) {
  Json part = to_json(spec);
  for (const char* member : {"name", "labels", "priority", "class", "preview_key", "seed", "stop",
                             "webhook", "retention_seconds"}) {
    part.erase(member);
  }
  part["sampler"].erase("replicates");
  part["sampler"].erase("first_replicate");
  if (part.contains("adaptive")) {
    part["adaptive"].erase(
        "min_samples");  // depends on the number of replicates, but does not change the expectation
  }
  return part;
}

void compare(const Json& a, const Json& b, const std::string& pointer,
             std::vector<std::string>& differences) {
  if (!a.is_object() || !b.is_object()) {
    if (a != b) {
      differences.push_back(pointer);
    }
    return;
  }
  for (const auto& member : a.items()) {
    const std::string place = join_pointer(pointer, member.key());
    if (const auto found = b.find(member.key()); found != b.end()) {
      compare(member.value(), *found, place, differences);
    } else {
      differences.push_back(place);
    }
  }
  for (const auto& member : b.items()) {
    if (!a.contains(member.key())) {
      differences.push_back(join_pointer(pointer, member.key()));
    }
  }
}

const Json* member(const Json& object, const char* name) {
  const auto found = object.find(name);
  return found == object.end() ? nullptr : &*found;
}

}  // namespace

std::string film_text(const JobView& job, const core::SampleLedger& ledger,
                      std::string_view film_digest) {
  Json body;
  body["version"] = kVersion;
  body["job"] = job.id;
  body["spec"] = to_json(job.spec);
  body["state"] = to_text(job.state);
  body["stop_reason"] = to_text(job.stop_reason);
  body["samples_by_error"] = job.samples_by_error;
  body["finished_at"] =
      job.finished_at_unix_seconds ? Json(rfc3339(*job.finished_at_unix_seconds)) : Json(nullptr);
  body["elapsed_seconds"] = number_json(job.progress.elapsed_seconds);
  body["error"] = error_view().print(job);
  body["warnings"] = job.warnings;
  body["doubted"] = job.is_doubted;
  body["samples"] = ledger_part(ledger);
  body["build"] = job.build.empty() ? Json(nullptr) : Json::parse(job.build, nullptr, false);
  body["film_digest"] = film_digest;
  return dump(body);
}

Parsed<FilmOrigin> parse_film_text(std::string_view text) {
  const Parsed<Json> body = parse_json(text, limits::kBodyBytes);
  if (!body) {
    return body.problem();
  }
  Faults faults;
  if (!expect_object(*body, "", faults)) {
    return faults.problem();
  }
  const Json* version = member(*body, "version");
  if (version == nullptr || *version != kVersion) {
    faults.add("/version", "is not " + std::to_string(kVersion));
  }
  const Json* spec = member(*body, "spec");
  const Json* reason = member(*body, "stop_reason");
  const Json* elapsed = member(*body, "elapsed_seconds");
  const auto stop_reason = reason != nullptr && reason->is_string()
                               ? stop_reason_from_text(reason->get<std::string>())
                               : std::nullopt;
  if (!stop_reason) {
    faults.add("/stop_reason", "is none");
  }
  constexpr double kYears = 1e10;
  const auto seconds = elapsed != nullptr
                           ? read_number(*elapsed, {0, kYears}, "/elapsed_seconds", faults)
                           : std::nullopt;
  if (spec == nullptr || elapsed == nullptr) {
    faults.add("", "has no spec or no elapsed_seconds");
  }
  if (!faults.empty()) {
    return faults.problem();
  }
  auto parsed = parse_job(dump(*spec));
  if (!parsed) {
    return parsed.problem();
  }
  const Json* build = member(*body, "build");
  const Json* by_error = member(*body, "samples_by_error");
  const Json* doubted = member(*body, "doubted");
  return FilmOrigin{
      .spec = std::move(parsed->spec),
      .stop_reason = *stop_reason,
      .is_ended_by_error = core::is_by_error(*stop_reason) ||
                           (by_error != nullptr && by_error->is_number_integer() && *by_error > 0),
      .elapsed_seconds = *seconds,
      .build = build != nullptr && build->is_object() ? dump(*build) : std::string(),
      .is_doubted = doubted != nullptr && doubted->is_boolean() && doubted->get<bool>()};
}

std::vector<std::string> film_differences(const JobSpec& first, const JobSpec& other) {
  std::vector<std::string> differences;
  compare(picture_part(first), picture_part(other), "", differences);
  return differences;
}

std::string text_of_build(std::string_view build_json, const char* name) {
  if (build_json.empty()) {
    return {};
  }
  const Parsed<Json> build = parse_json(build_json, limits::kBodyBytes);
  const Json* text = build && build->is_object() ? member(*build, name) : nullptr;
  return text != nullptr && text->is_string() ? text->get<std::string>() : std::string();
}

std::string arithmetic_of(std::string_view build_json) {
  return text_of_build(build_json, "arithmetic");
}

std::string ledger_words(const core::SampleLedger& ledger) {
  std::string words;
  for (const core::SampleRange& range : ledger) {
    words += (words.empty() ? "" : ", ") + ("seed " + std::to_string(range.seed)) +
             " (replicates " + std::to_string(range.first_replicate) + " to " +
             std::to_string(range.first_replicate + range.replicates - 1) + ", " +
             std::to_string(range.samples) + " samples)";
  }
  return words;
}

std::string ledger_json(const core::SampleLedger& ledger) {
  return ledger.empty() ? std::string() : dump(ledger_part(ledger));
}

Parsed<core::SampleLedger> parse_ledger(std::string_view text) {
  core::SampleLedger ledger;
  if (text.empty()) {
    return ledger;
  }
  const Parsed<Json> list = parse_json(text, limits::kBodyBytes);
  if (!list) {
    return list.problem();
  }
  Faults faults;
  for (const Json& entry : *list) {
    const auto read = [&](const char* name, double most) {
      const Json* value = entry.is_object() ? member(entry, name) : nullptr;
      const auto number = value != nullptr
                              ? read_integer(*value, {0, most}, join_pointer("", name), faults)
                              : std::nullopt;
      if (value == nullptr) {
        faults.add(join_pointer("", name), "is missing");
      }
      return number.value_or(0);
    };
    ledger.push_back(
        {.seed = static_cast<std::uint64_t>(read("seed", static_cast<double>(limits::kSeed))),
         .first_replicate = static_cast<int>(read("first_replicate", 1 << 20)),
         .replicates = static_cast<int>(read("replicates", limits::kReplicates)),
         .samples = static_cast<int>(read("samples_per_pixel", 1 << 30))});
  }
  if (!faults.empty()) {
    return faults.problem();
  }
  return ledger;
}

}  // namespace api
