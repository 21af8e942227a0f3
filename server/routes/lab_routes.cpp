// The estimator laboratory.

#include <memory>
#include <string>
#include <utility>

#include "api/json/error_codes.h"
#include "api/json/limits.h"
#include "api/lab.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/lab_stream.h"

namespace server {
namespace {

core::Error no_place(const StreamGate& places, const std::string& tenant) {
  const int of_tenant = places.open_count_of(tenant);
  const std::string why =
      places.limit_of_owner() > 0 && of_tenant >= places.limit_of_owner()
          ? "the tenant '" + tenant + "' runs " + std::to_string(of_tenant) + " experiments already"
          : std::to_string(places.limit()) + " experiments run already";
  return core::Error{api::kTooManyRequests, why, ""};
}

Response run_experiment(const std::shared_ptr<StreamGate>& places, const Request& request) {
  auto parsed = api::parse_lab_request(request.body);
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  const auto place = std::make_shared<StreamSlot>(places->try_enter(request.access.tenant));
  if (!*place) {
    return error_answer(request, no_place(*places, request.access.tenant));
  }
  const auto stream = std::make_shared<LabStream>(*std::move(parsed));
  return stream_response("application/x-ndjson", [places, place, stream](StreamWriter& writer) {
    stream->run(writer);
    *place = StreamSlot();
  });
}

}  // namespace

void add_lab_handlers(const RouteContext& context, HandlerTable& table) {
  const auto places =
      std::make_shared<StreamGate>(context.config.lab_runs_max, context.config.quota_lab_runs);
  table["runExperiment"] = {
      .handler = [places](const RouteContext&,
                          Request& request) { return run_experiment(places, request); },
      .body = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes))};
}

}  // namespace server
