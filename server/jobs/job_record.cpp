#include "server/jobs/job_record.h"

#include <algorithm>
#include <cmath>

#include "api/errors.h"
#include "api/film_view.h"
#include "api/values.h"
#include "core/settings/registry.h"

namespace server {
namespace {

using api::JobState;

std::optional<double> known(double value) {
  return std::isnan(value) ? std::nullopt : std::optional<double>(value);
}

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
  return view.ledger.empty() ? std::make_shared<core::Film>(settings)
                             : std::make_shared<core::Film>(settings.film, settings.replicates,
                                                            core::pixel_errors(settings));
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

}  // namespace

JobRow to_row(const JobRecord& record) {
  const api::JobView& view = record.view;
  JobRow row;
  row.sequence = record.sequence;
  row.id = view.id;
  row.spec_json = api::dump(api::to_json(view.spec));
  row.spec_version = view.spec_version;
  row.scene = view.spec.scene;
  row.name = view.spec.name;
  row.environment_asset = view.spec.environment_asset.value_or("");
  row.labels = view.spec.labels;
  row.priority = view.spec.priority;
  row.state = api::to_text(view.state);
  row.pause_reason = api::to_text(view.pause_reason);
  row.stop_reason = api::to_text(view.stop_reason);
  row.created_at = view.created_at_unix_seconds;
  row.started_at = view.started_at_unix_seconds;
  row.finished_at = view.finished_at_unix_seconds;
  row.warnings = warning_lines(view);
  if (record.failure) {
    row.failure = *record.failure;
  }
  row.tenant = record.tenant;
  row.film = record.film;
  row.film_bytes = record.film_bytes;
  row.film_digest = view.film_digest;
  row.revision = view.progress.revision;
  row.fraction = view.progress.fraction;
  row.samples_min = view.progress.samples_min;
  row.samples_mean = view.progress.samples_mean;
  row.samples_max = view.progress.samples_max;
  row.elapsed_seconds = view.progress.elapsed_seconds;
  row.cpu_seconds = view.progress.cpu_seconds;
  row.rays = view.progress.rays;
  row.rejected_samples = view.progress.rejected_samples;
  row.peak_bytes = view.peak_bytes;
  row.error_grain = known(view.progress.error.grain);
  row.error_doubt = known(view.progress.error.doubt);
  row.error_reach = known(view.progress.error.reach);
  if (view.spec.retention_seconds && view.finished_at_unix_seconds) {
    row.delete_at = *view.finished_at_unix_seconds + *view.spec.retention_seconds;
  }
  row.build = view.build;
  row.ledger = api::ledger_json(view.ledger);
  row.samples_by_error = view.samples_by_error;
  row.split_count = view.split_count;
  row.light_not_found = api::light_not_found_json(view.progress.light_not_found);
  return row;
}

/// The form of a job's stored errors.
static core::ErrorForm form_of(const core::RenderSettings& settings) {
  return core::halves_show_error(settings) ? core::ErrorForm::kHalves : core::ErrorForm::kSquares;
}

core::Result<JobRecord> to_record(const JobRow& row) {
  auto parsed = api::parse_job(row.spec_json);
  const auto state = api::job_state_from_text(row.state);
  const auto ledger = api::parse_ledger(row.ledger);
  if (!ledger) {
    return core::Error{core::ErrorCode::kInternal,
                       "the stored job's ledger cannot be read: " + ledger.problem().detail,
                       row.id};
  }
  if (!parsed || !state) {
    return core::Error{core::ErrorCode::kInternal,
                       "the stored job cannot be read: " +
                           (parsed ? "state " + row.state : parsed.problem().detail),
                       row.id};
  }
  JobRecord record;
  record.sequence = row.sequence;
  record.tenant = row.tenant;
  record.film = row.film;
  record.film_bytes = row.film_bytes;
  api::JobView& view = record.view;
  view.id = row.id;
  view.state = *state;
  view.pause_reason =
      api::pause_reason_from_text(row.pause_reason).value_or(api::PauseReason::kNone);
  view.stop_reason = api::stop_reason_from_text(row.stop_reason).value_or(core::StopReason::kNone);
  view.created_at_unix_seconds = row.created_at;
  view.started_at_unix_seconds = row.started_at;
  view.finished_at_unix_seconds = row.finished_at;
  view.spec = std::move(parsed->spec);
  view.spec_version = static_cast<std::uint32_t>(row.spec_version);
  read_warning_lines(row.warnings, view);
  view.film_digest = row.film_digest;
  view.peak_bytes = row.peak_bytes;
  view.build = row.build;
  view.ledger = *ledger;
  view.samples_by_error = row.samples_by_error;
  view.split_count = row.split_count;
  if (!row.failure.message.empty()) {
    record.failure = row.failure;
    view.failure = api::from_error(row.failure);
  }
  core::Progress& progress = view.progress;
  progress.revision = row.revision;
  progress.fraction = row.fraction;
  progress.samples_min = row.samples_min;
  progress.samples_mean = row.samples_mean;
  progress.samples_max = row.samples_max;
  progress.elapsed_seconds = row.elapsed_seconds;
  progress.cpu_seconds = row.cpu_seconds;
  progress.rays = row.rays;
  progress.rejected_samples = row.rejected_samples;
  // A job that was cut short in its first pass may have points without a sample.
  progress.has_meter_readings = !view.spec.render.meter.empty() &&
                                (*state == api::JobState::kFinished || row.samples_min > 1);
  progress.error = row.error_grain && row.error_doubt && row.error_reach
                       ? core::error_interval(*row.error_grain, *row.error_doubt, *row.error_reach,
                                              form_of(view.spec.render))
                       : core::unknown_error();
  progress.light_not_found = api::parse_light_not_found(row.light_not_found);
  if (row.elapsed_seconds > 0) {
    progress.rays_per_second = static_cast<double>(row.rays) / row.elapsed_seconds;
  }
  return record;
}

}  // namespace server
