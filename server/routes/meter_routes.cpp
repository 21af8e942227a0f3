// Readings of meters, and their comparison.

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "api/answers/job_view.h"
#include "api/queries/queries.h"
#include "core/film/meter_reading.h"
#include "core/lights/outdoor.h"
#include "core/render/picture/unsampled_light.h"
#include "server/jobs/film_library.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/with_query.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

/// Returns the readings of the job's meter, or why there are none.
core::Result<api::MeterOfJob> meter_of(const RouteContext& context, const Job& job) {
  const core::MeterSettings meter = job.record().view.spec.render.meter;
  if (meter.empty()) {
    return Error{ErrorCode::kNotFound, "the job has no meter", ""};
  }
  const auto film = context.jobs.films().film(job);
  if (!film) {
    return film.error();
  }
  // Without the scene, which may have been deleted, only the samples bound the readings.
  const auto view = context.jobs.scene_view(job);
  api::MeterOfJob out;
  out.job = job.id();
  out.readings = core::meter_readings(core::meter_points(meter), (*film)->meter(),
                                      view ? core::unsampled_path_light(*view) : 0);
  if (out.readings.empty()) {
    return Error{ErrorCode::kConflict, "the meter has no sample yet", ""};
  }
  out.outdoor_lux = view && view->environment && !view->environment->is_black()
                        ? core::horizontal_irradiance(*view->environment)
                        : std::numeric_limits<double>::quiet_NaN();
  return out;
}

Response meter(const RouteContext& context, Request& request, const JobPointer& job) {
  const auto found = meter_of(context, *job);
  return found ? json_response(200, api::meter_json(*found)) : error_answer(request, found.error());
}

Response meter_table(const RouteContext& context, Request& request, const JobPointer& job) {
  const auto found = meter_of(context, *job);
  return found ? text_response(200, "text/csv; charset=utf-8", api::meter_csv(found->readings))
               : error_answer(request, found.error());
}

bool has_same_place(const core::MeterReading& a, const core::MeterReading& b) {
  return a.at.position == b.at.position;
}

Response compare(const RouteContext& context, Request& request,
                 const api::MeterComparisonQuery& query) {
  const auto side = [&](const std::string& id,
                        const char* pointer) -> core::Result<api::MeterOfJob> {
    const auto job = context.jobs.find(id, request.access);
    auto meter = job ? meter_of(context, **job) : core::Result<api::MeterOfJob>(job.error());
    return meter ? std::move(meter) : Error{meter.error().code, meter.error().message, pointer};
  };
  const auto a = side(query.a, "/a");
  const auto b = a ? side(query.b, "/b") : a;
  if (!b) {
    return error_answer(request, b.error());
  }
  if (!std::equal(a->readings.begin(), a->readings.end(), b->readings.begin(), b->readings.end(),
                  &has_same_place)) {
    return error_answer(request, ErrorCode::kConflict, "the meters have different points");
  }
  return json_response(200, api::meter_comparison_json(*a, *b));
}

}  // namespace

void add_meter_handlers(HandlerTable& table) {
  table["getMeter"] = {.of_job = &meter};
  table["getMeterTable"] = {.of_job = &meter_table};
  table["compareMeters"] = {.handler = with_query(&api::parse_meter_comparison_query, &compare)};
}

}  // namespace server
