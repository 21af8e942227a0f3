// The streams of a job: events and tiles.

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "api/answers/events.h"
#include "api/answers/job_view.h"
#include "api/json/error_codes.h"
#include "api/json/limits.h"
#include "api/queries/queries.h"
#include "api/requests.h"
#include "server/http/sse.h"
#include "server/observe/clock.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/event_stream.h"
#include "server/routes/jobs_stream.h"
#include "server/routes/tile_stream.h"
#include "server/routes/with_query.h"

namespace server {
namespace {

constexpr int kOverloadedRetrySeconds = 15;

/// EventSource cannot read a status code, so the refusal is sent as an event.
Response overloaded() {
  const std::string data = api::overloaded_event(kOverloadedRetrySeconds);
  Response response =
      text_response(200, "text/event-stream",
                    format_sse(SseEvent{.id = {},
                                        .event = api::to_text(api::EventType::kOverloaded),
                                        .data = data,
                                        .retry_ms = kOverloadedRetrySeconds * 1000}));
  response.headers.set("Cache-Control", "no-store");
  return response;
}

/// stream: an EventStream or a JobsStream.
template <typename Stream>
Response events_answer(const RouteContext& context, const Request& request,
                       const std::shared_ptr<Stream>& stream) {
  if (stream->is_over()) {
    return empty_response();
  }
  StreamSlot slot = context.streams.try_enter(request.access.tenant);
  if (!slot) {
    return overloaded();
  }
  return stream_response(
      "text/event-stream", [stream](StreamWriter& writer) { stream->run(writer); },
      std::move(slot));
}

Response events(const RouteContext& context, Request& request, const JobPointer& job,
                const api::JobEventsQuery& /*query*/) {
  return events_answer(context, request,
                       std::make_shared<EventStream>(context.jobs, job, last_event_id(request),
                                                     context.streams, EventStream::Options{}));
}

Response tiles(const RouteContext& context, Request& request, const JobPointer& job,
               const api::TilesQuery& query) {
  if (!job->record().view.spec.has_image) {
    return empty_response();
  }
  if (const auto film = context.jobs.films().film(*job); !film && film.error().code == api::kGone) {
    return error_answer(request, film.error());
  }
  if (query.denoise != api::DenoiseShow::kOff) {
    if (const auto fits = context.denoising.check(*job, query.denoise); !fits) {
      return error_answer(request, fits.error());
    }
  }
  auto stream = std::make_shared<TileStream>(
      TileStream::Parts{context.jobs, context.denoising, context.tile_frames, context.streams}, job,
      query);
  Response response = stream_response("application/vnd.tessera.tiles",
                                      [stream](StreamWriter& writer) { stream->run(writer); });
  response.compressible = true;
  return response;
}

Response watch(const RouteContext& context, Request& request, const api::EventsQuery& query) {
  std::vector<JobPointer> watched;
  if (!query.batch.empty()) {
    auto jobs = context.batches.jobs(query.batch, request.access);
    if (!jobs) {
      return error_answer(request, jobs.error());
    }
    watched = *std::move(jobs);
  }
  for (const std::string& id : query.jobs) {
    auto job = context.jobs.find(id, request.access);
    if (!job) {
      return error_answer(request, job.error());
    }
    watched.push_back(*std::move(job));
  }
  const std::string last(
      request.header("Last-Event-ID").value_or(request.query("last_event_id").value_or("")));
  return events_answer(context, request,
                       std::make_shared<JobsStream>(context.jobs, watched, last, context.streams));
}

Response create_ticket(const RouteContext& context, Request& request) {
  const auto parsed = api::parse_ticket(request.body);
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  for (const std::string& id : parsed->jobs) {
    if (const auto job = context.jobs.find(id, request.access); !job) {
      return error_answer(request, job.error());
    }
  }
  const auto ticket =
      context.tickets.issue(parsed->jobs, {.key = request.principal, .access = request.access});
  if (!ticket) {
    return error_answer(request, api::kTooManyRequests, "too many open tickets");
  }
  const double ends = unix_now() + std::chrono::duration<double>(Tickets::kLife).count();
  Response response = json_response(201, api::ticket_json(*ticket, ends, parsed->jobs));
  response.headers.set("Cache-Control", "no-store");
  return response;
}

}  // namespace

void add_stream_handlers(HandlerTable& table) {
  table["streamEvents"] = {.handler = with_query(&api::parse_job_events_query, &events)};
  table["watchJobs"] = {.handler = with_query(&api::parse_events_query, &watch)};
  table["createStreamTicket"] = {
      .handler = &create_ticket,
      .body = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes))};
  table["streamTiles"] = {.handler = with_query(&api::parse_tiles_query, &tiles)};
}

}  // namespace server
