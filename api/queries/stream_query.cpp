// Queries of the streams: tiles and events.
#include <algorithm>
#include <array>
#include <span>

#include <nlohmann/json.hpp>

#include "api/answers/server_view.h"
#include "api/json/faults.h"
#include "api/json/limits.h"
#include "api/json/query_rows.h"
#include "api/json/values.h"
#include "api/queries/queries.h"
#include "api/requests.h"
#include "core/settings/choices.h"

namespace api {
namespace {

constexpr std::string_view kLastEventIdDoc =
    "Same as the header Last-Event-ID, for pages whose EventSource cannot send it on the first "
    "request.";
constexpr std::int64_t kUuidCharacters = 36;

constexpr std::array kTilePlanes = {
    core::NamedValue<TilePlanes>{"all", TilePlanes::kAll,
                                 "Mean, variance and sample count, 28 bytes per pixel."},
    core::NamedValue<TilePlanes>{"mean", TilePlanes::kMean, "The mean alone, 6 bytes per pixel."},
};
std::span<const core::NamedValue<TilePlanes>> tile_planes() { return kTilePlanes; }

const auto& tiles_table() {
  static constexpr auto kTable = std::tuple{
      number("after", &TilesQuery::after, {0, kRevisionMax},
             "Only tiles newer than this revision."),
      choice("planes", &TilesQuery::planes, &tile_planes,
             "mean: float16 planes of the mean, and of alpha where flagged; enough to show the "
             "image."),
      choice(
          "denoise", &TilesQuery::denoise, &denoise_shows,
          "mixed, full: also sends frames of the denoised image, flagged 16, all tiles at once, at "
          "most every two seconds and for at most 5% of the job's time."),
      choice("fireflies", &TilesQuery::fireflies, &fireflies_choices,
             "set_aside: as in images of display formats; only with planes=mean."),
      ticket_row<TilesQuery>(),
  };
  return kTable;
}

template <typename S>
constexpr auto last_event_id_row() {
  return ParameterField<S>{"last_event_id", kLastEventIdDoc,
                           [](const std::string& value, S& out, const std::string&, Faults&) {
                             out.last_event_id = value;
                           },
                           [](const S&) { return text_schema(); }};
}

const auto& job_events_table() {
  static constexpr auto kTable =
      std::tuple{last_event_id_row<JobEventsQuery>(), ticket_row<JobEventsQuery>()};
  return kTable;
}

/// The server uses last_event_id from the header or from here.
struct EventsReading {
  EventsQuery query;
  std::string last_event_id;
};

void read_jobs(const std::string& text, EventsReading& out, const std::string& pointer,
               Faults& faults) {
  each_part(text, [&](const std::string& id) {
    if (expect_uuid(id, "job", pointer, faults) &&
        std::find(out.query.jobs.begin(), out.query.jobs.end(), id) == out.query.jobs.end()) {
      out.query.jobs.push_back(id);
    }
  });
  if (out.query.jobs.size() > static_cast<std::size_t>(limits::kWatchedJobs)) {
    faults.add(pointer, "names " + std::to_string(out.query.jobs.size()) + " jobs; at most " +
                            std::to_string(limits::kWatchedJobs) + " are allowed");
  }
}

void read_batch(const std::string& text, EventsReading& out, const std::string& pointer,
                Faults& faults) {
  expect_uuid(text, "batch", pointer, faults);
  out.query.batch = text;
}

const auto& events_table() {
  static constexpr auto kTable =
      std::tuple{ParameterField<EventsReading>{
                     "jobs", "Comma-separated job ids; at most `watched_jobs`.", &read_jobs,
                     [](const EventsReading&) {
                       return Json{{"type", "string"},
                                   {"minLength", kUuidCharacters},
                                   {"maxLength", limits::kWatchedJobs * (kUuidCharacters + 1) - 1}};
                     }},
                 ParameterField<EventsReading>{
                     "batch", "Id of a batch, instead of `jobs`: all of its jobs.", &read_batch,
                     [](const EventsReading&) {
                       return Json{{"type", "string"}, {"format", "uuid"}};
                     }},
                 last_event_id_row<EventsReading>(), ticket_row<EventsReading>()};
  return kTable;
}

}  // namespace

Parsed<TilesQuery> parse_tiles_query(QueryParams query) {
  Parsed<TilesQuery> parsed = parse_query(tiles_table(), query, TilesQuery{});
  if (parsed && parsed->fireflies == Fireflies::kSetAside && parsed->planes != TilePlanes::kMean) {
    Faults faults;
    faults.add("/fireflies", "applies only to planes=mean: variances are those of all light");
    return faults.problem();
  }
  return parsed;
}
Parsed<JobEventsQuery> parse_job_events_query(QueryParams query) {
  return parse_query(job_events_table(), query, JobEventsQuery{});
}
Parsed<EventsQuery> parse_events_query(QueryParams query) {
  const auto reading = parse_query(events_table(), query, EventsReading{});
  if (!reading) {
    return reading.problem();
  }
  if (reading->query.jobs.empty() == reading->query.batch.empty()) {
    Faults faults;
    faults.add("/jobs", reading->query.batch.empty() ? "is required, or batch"
                                                     : "and batch exclude each other");
    return faults.problem();
  }
  return reading->query;
}

Json tiles_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(tiles_table(), TilesQuery{});
}
Json job_events_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(job_events_table(), JobEventsQuery{});
}
Json events_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(events_table(), EventsReading{});
}

}  // namespace api
