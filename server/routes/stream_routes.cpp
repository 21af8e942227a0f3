// The streams of a job: events and tiles.

#include <memory>
#include <string>
#include <utility>

#include "api/events.h"
#include "api/requests.h"
#include "server/http/sse.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/event_stream.h"
#include "server/routes/tile_stream.h"

namespace server {
namespace {

constexpr int kOverloadedRetrySeconds = 15;

/// EventSource cannot read a status code: the refusal is an event.
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

Response events(const RouteContext& context, Request& request) {
  auto found = find_job(context.jobs, request);
  if (auto* answer = std::get_if<Response>(&found)) {
    return std::move(*answer);
  }
  auto stream = std::make_shared<EventStream>(context.jobs, *std::get_if<JobPointer>(&found),
                                              last_event_id(request), context.streams,
                                              EventStream::Options{});
  if (stream->is_over()) {
    return empty_response();
  }
  StreamSlot slot = context.streams.try_enter();
  if (!slot) {
    return overloaded();
  }
  return stream_response(
      "text/event-stream", [stream](StreamWriter& writer) { stream->run(writer); }, std::move(slot));
}

Response tiles(const RouteContext& context, Request& request) {
  const auto query = api::parse_tiles_query(request.query_params);
  if (!query) {
    return problem_answer(request, query.problem());
  }
  auto found = find_job(context.jobs, request);
  if (auto* answer = std::get_if<Response>(&found)) {
    return std::move(*answer);
  }
  const JobPointer job = *std::get_if<JobPointer>(&found);
  if (const auto film = context.jobs.film(*job);
      !film && film.error().code == core::ErrorCode::kGone) {
    return error_answer(request, film.error());
  }
  StreamSlot slot = context.streams.try_enter();
  if (!slot) {
    return error_answer(request, core::ErrorCode::kUnavailable, "too many streams are open");
  }
  auto stream = std::make_shared<TileStream>(context.jobs, job, query->after,
                                             context.streams);
  Response response = stream_response(
      "application/vnd.tessera.tiles", [stream](StreamWriter& writer) { stream->run(writer); },
      std::move(slot));
  response.compressible = true;
  return response;
}

}  // namespace

void add_stream_handlers(const RouteContext& context, HandlerTable& table) {
  table["streamEvents"] = {.handler = [context](Request& request) { return events(context, request); }};
  table["streamTiles"] = {.handler = [context](Request& request) { return tiles(context, request); }};
}

}  // namespace server
