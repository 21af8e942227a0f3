#include "server/jobs/job_record.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <utility>

#include <nlohmann/json.hpp>

#include "api/answers/film_view.h"
#include "api/json/errors.h"
#include "api/json/json.h"
#include "api/json/values.h"
#include "core/integrators/registry.h"

namespace server {
namespace {

using api::JobState;
using api::Json;

/// Begins the warning of a doubted job.
constexpr std::string_view kDoubtedWarning =
    "A worker that rendered parts of the image without a check by a second one returned wrong "
    "results later: the image may be wrong.";

}  // namespace

bool may_change(JobState from, JobState to) {
  if (from == to) {
    return true;
  }
  switch (to) {
    case JobState::kQueued:
      return from != JobState::kCancelled;
    case JobState::kLoading:
      return from == JobState::kQueued;
    case JobState::kRendering:
      return from == JobState::kLoading || from == JobState::kPaused;
    case JobState::kPaused:
      return from == JobState::kQueued || from == JobState::kLoading ||
             from == JobState::kRendering;
    case JobState::kFinished:
      return from == JobState::kRendering || from == JobState::kPaused;
    case JobState::kFailed:
    case JobState::kCancelled:
      return !api::is_final(from);
  }
  return false;
}

bool is_memory_only(const api::JobSpec& spec) { return spec.job_class == api::JobClass::kPreview; }

std::shared_ptr<core::Film> blank_film(const api::JobView& view) {
  const core::RenderSettings& settings = view.spec.render;
  // Merged films have no plans or fits.
  return view.ledger.empty() ? core::make_film(settings)
                             : std::make_shared<core::Film>(settings.film, settings.replicates,
                                                            core::pixel_errors(settings));
}

void forget_samples(JobRecord& record) {
  // Clients have seen the revision: it does not return to lower ones.
  const std::uint32_t revision = record.view.progress.revision;
  record.view.progress = api::JobView::nothing_rendered();
  record.view.progress.revision = revision;
  record.film = FilmPlace::kNone;
  record.film_bytes = 0;
  record.unverified.clear();
  record.view.is_doubted = false;
  std::erase_if(record.view.warnings,
                [](const std::string& text) { return text.starts_with(kDoubtedWarning); });
}

bool can_begin_again(const api::JobView& view) {
  return view.is_doubted && view.state != JobState::kCancelled && view.ledger.empty();
}

void doubt(api::JobView& view) {
  if (view.is_doubted) {
    return;
  }
  view.is_doubted = true;
  const char* remedy = can_begin_again(view) ? "Retry the job to render it anew."
                       : !view.ledger.empty()
                           ? "Retry the jobs of the films that were merged, and merge them again."
                           : "Submit the job again to render it anew.";
  view.warnings.push_back(std::string(kDoubtedWarning) + ' ' + remedy);
}

void note_samples_by_error(api::JobView& view) {
  const auto samples = static_cast<int>(std::llround(view.progress.samples_mean));
  if (core::is_by_error(view.stop_reason)) {
    view.samples_by_error = std::max(samples, 1);
    return;
  }
  const bool is_fixed = view.stop_reason == core::StopReason::kSamples ||
                        view.stop_reason == core::StopReason::kLimit;
  if (is_fixed && samples > view.samples_by_error) {
    view.samples_by_error = 0;
  }
}

std::vector<std::string> new_warnings(const api::JobView& before, const api::JobView& after) {
  std::vector<std::string> warnings = after.warnings;
  std::erase_if(warnings, [&](const std::string& warning) {
    return std::find(before.warnings.begin(), before.warnings.end(), warning) !=
           before.warnings.end();
  });
  return warnings;
}

namespace {

/// Without the characters that separate lines and the parts of a line.
std::string one_word(std::string text) {
  for (char& c : text) {
    c = c == '\n' || c == '\t' ? ' ' : c;
  }
  return text;
}

/// One line per warning: its text, or code, pointer and detail, separated by tabs.
std::vector<std::string> warning_lines(const api::JobView& view) {
  std::vector<std::string> lines;
  for (const std::string& text : view.warnings) {
    const auto detail = std::find_if(view.warning_details.begin(), view.warning_details.end(),
                                     [&](const core::Warning& w) { return w.text() == text; });
    lines.push_back(detail == view.warning_details.end()
                        ? one_word(text)
                        : one_word(detail->code) + '\t' + one_word(detail->pointer) + '\t' +
                              one_word(detail->detail));
  }
  return lines;
}

void read_warning_lines(const std::vector<std::string>& lines, api::JobView& view) {
  for (const std::string& line : lines) {
    const std::size_t first = line.find('\t');
    const std::size_t second = line.find('\t', first + 1);
    if (first == std::string::npos || second == std::string::npos) {
      view.warnings.push_back(line);
      continue;
    }
    api::add_warning(view, {line.substr(0, first), line.substr(first + 1, second - first - 1),
                            line.substr(second + 1)});
  }
}

/// Calls visit(name, member) for each plain member of a stored job. One list writes and reads it:
/// a member that an older document lacks keeps its default.
template <typename Record, typename Visit>
void visit_members(Record& record, Visit&& visit) {
  auto& view = record.view;
  auto& progress = view.progress;
  visit("state", view.state);
  visit("pause_reason", view.pause_reason);
  visit("stop_reason", view.stop_reason);
  visit("created_at", view.created_at_unix_seconds);
  visit("started_at", view.started_at_unix_seconds);
  visit("finished_at", view.finished_at_unix_seconds);
  visit("spec_version", view.spec_version);
  visit("film", record.film);
  visit("film_bytes", record.film_bytes);
  visit("film_digest", view.film_digest);
  visit("peak_bytes", view.peak_bytes);
  visit("samples_by_error", view.samples_by_error);
  visit("split_count", view.split_count);
  visit("revision", progress.revision);
  visit("fraction", progress.fraction);
  visit("samples_min", progress.samples_min);
  visit("samples_mean", progress.samples_mean);
  visit("samples_max", progress.samples_max);
  visit("elapsed_seconds", progress.elapsed_seconds);
  visit("cpu_seconds", progress.cpu_seconds);
  visit("rays", progress.rays);
  visit("rejected_samples", progress.rejected_samples);
  visit("error_grain", progress.error.grain);
  visit("error_doubt", progress.error.doubt);
  visit("error_reach", progress.error.reach);
  visit("unverified", record.unverified);
  visit("is_doubted", view.is_doubted);
}

template <typename Value>
Json plain(const Value& value) {
  if constexpr (std::is_same_v<Value, std::optional<double>>) {
    return value ? Json(*value) : Json(nullptr);
  } else {
    return value;
  }
}
Json plain(JobState value) { return api::to_text(value); }
Json plain(api::PauseReason value) { return api::to_text(value); }
Json plain(core::StopReason value) { return api::to_text(value); }

/// The reverse of plain(); unknown words change nothing. Throws Json::exception for other types.
template <typename Value>
void read(const Json& from, Value& value) {
  if constexpr (std::is_same_v<Value, std::optional<double>>) {
    value = from.is_null() ? std::nullopt : std::optional(from.get<double>());
  } else {
    from.get_to(value);
  }
}
void read(const Json& from, double& value) {  // What is not a number was written as null.
  value = from.is_null() ? std::numeric_limits<double>::quiet_NaN() : from.get<double>();
}
void read(const Json& from, JobState& value) {
  value = api::job_state_from_text(from.get<std::string>()).value_or(value);
}
void read(const Json& from, api::PauseReason& value) {
  value = api::pause_reason_from_text(from.get<std::string>()).value_or(value);
}
void read(const Json& from, core::StopReason& value) {
  value = api::stop_reason_from_text(from.get<std::string>()).value_or(value);
}

/// The value of a JSON text; null for none.
Json parsed_text(const std::string& text) {
  return text.empty() ? Json(nullptr) : Json::parse(text, nullptr, false);
}

std::string text_of(const Json& document, const char* name) {
  const auto found = document.find(name);
  const bool is_none = found == document.end() || found->is_null() ||
                       (found->is_string() && found->get<std::string>().empty());
  return is_none ? std::string() : api::dump(*found);
}

std::string document_of(const JobRecord& record) {
  Json document;
  visit_members(record,
                [&](const char* name, const auto& value) { document[name] = plain(value); });
  document["spec"] = api::to_json(record.view.spec);
  document["warnings"] = warning_lines(record.view);
  document["failure"] = record.failure ? Json{{"code", static_cast<int>(record.failure->code)},
                                              {"message", record.failure->message},
                                              {"where", record.failure->where}}
                                       : Json(nullptr);
  document["build"] = parsed_text(record.view.build);
  document["ledger"] = parsed_text(api::ledger_json(record.view.ledger));
  document["light_not_found"] =
      parsed_text(api::light_not_found_json(record.view.progress.light_not_found));
  return api::dump(document);
}

/// The form of a job's stored errors.
core::ErrorForm form_of(const core::RenderSettings& settings) {
  return core::halves_show_error(settings) ? core::ErrorForm::kHalves : core::ErrorForm::kSquares;
}

/// Sets what follows from the members that are stored.
void complete(api::JobView& view) {
  core::Progress& progress = view.progress;
  const core::ErrorInterval error = progress.error;
  const bool is_known =
      !std::isnan(error.grain) && !std::isnan(error.doubt) && !std::isnan(error.reach);
  progress.error = is_known ? core::error_interval(error.grain, error.doubt, error.reach,
                                                   form_of(view.spec.render))
                            : core::unknown_error();
  // A job that was cut short in its first pass may have points without a sample.
  progress.has_meter_readings = !view.spec.render.meter.empty() &&
                                (view.state == JobState::kFinished || progress.samples_min > 1);
  if (progress.elapsed_seconds > 0) {
    progress.rays_per_second = static_cast<double>(progress.rays) / progress.elapsed_seconds;
  }
}

/// Reads a document into the record. Returns the fault; empty: none. Throws Json::exception for a
/// member of another type.
std::string read_document(const Json& document, JobRecord& record) {
  visit_members(record, [&](const char* name, auto& value) {
    if (const auto found = document.find(name); found != document.end()) {
      read(*found, value);
    }
  });
  if (const std::string state = document.value("state", "queued");
      !api::job_state_from_text(state)) {
    return "state " + state;
  }
  api::JobView& view = record.view;
  auto parsed = api::parse_job(text_of(document, "spec"));
  if (!parsed) {
    return parsed.problem().detail;
  }
  view.spec = std::move(parsed->spec);
  const auto ledger = api::parse_ledger(text_of(document, "ledger"));
  if (!ledger) {
    return "its ledger: " + ledger.problem().detail;
  }
  view.ledger = *ledger;
  view.build = text_of(document, "build");
  view.progress.light_not_found = api::parse_light_not_found(text_of(document, "light_not_found"));
  read_warning_lines(document.value("warnings", std::vector<std::string>()), view);
  if (const auto failure = document.find("failure");
      failure != document.end() && failure->is_object()) {
    record.failure = core::Error{static_cast<core::ErrorCode>(failure->value("code", 0)),
                                 failure->value("message", ""), failure->value("where", "")};
    view.failure = api::from_error(*record.failure);
  }
  complete(view);
  return {};
}

}  // namespace

JobRow to_row(const JobRecord& record) {
  const api::JobView& view = record.view;
  JobRow row{.sequence = record.sequence,
             .id = view.id,
             .state = std::string(api::to_text(view.state)),
             .scene = view.spec.scene,
             .environment_asset = view.spec.environment_asset.value_or(""),
             .finished_at = view.finished_at_unix_seconds,
             .film = record.film,
             .film_bytes = record.film_bytes,
             .cpu_seconds = view.progress.cpu_seconds,
             .record = document_of(record),
             .tenant = record.tenant,
             .name = view.spec.name,
             .labels = view.spec.labels};
  if (view.spec.retention_seconds && view.finished_at_unix_seconds) {
    row.delete_at = *view.finished_at_unix_seconds + *view.spec.retention_seconds;
  }
  return row;
}

std::string text_of_worker(const std::string& worker) { return api::dump(worker); }

bool is_damaged(const core::Error& error, std::string_view id) {
  return error.code == core::ErrorCode::kInternal && error.where == id;
}

core::Result<JobRecord> to_record(const JobRow& row) {
  const auto fail = [&](const std::string& why) {
    return core::Error{core::ErrorCode::kInternal, "the stored job cannot be read: " + why, row.id};
  };
  if (row.is_damaged) {
    return fail("its checksum does not match");
  }
  const Json document = Json::parse(row.record, nullptr, false);
  if (!document.is_object()) {
    return fail("it is not JSON");
  }
  JobRecord record;
  record.sequence = row.sequence;
  record.tenant = row.tenant;
  record.view.id = row.id;
  try {
    const std::string fault = read_document(document, record);
    return fault.empty() ? core::Result<JobRecord>(std::move(record)) : fail(fault);
  } catch (const Json::exception& error) {
    return fail(error.what());
  }
}
}  // namespace server
