// The estimator laboratory.

#include <memory>
#include <string>
#include <utility>

#include "api/lab.h"
#include "api/limits.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/lab_stream.h"

namespace server {
namespace {

Response run_experiment(const std::shared_ptr<StreamGate>& runs, const Request& request) {
  if (auto refused = refuse_query(request)) {
    return std::move(*refused);
  }
  auto parsed = api::parse_lab_request(request.body);
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  const auto place = std::make_shared<StreamSlot>(runs->try_enter());
  if (!*place) {
    return error_answer(request, core::ErrorCode::kTooManyRequests,
                        std::to_string(runs->limit()) + " experiments run already");
  }
  const auto stream = std::make_shared<LabStream>(*std::move(parsed));
  return stream_response("application/x-ndjson", [runs, place, stream](StreamWriter& writer) {
    stream->run(writer);
    *place = StreamSlot();
  });
}

}  // namespace

void add_lab_handlers(const RouteContext& context, HandlerTable& table) {
  const auto runs = std::make_shared<StreamGate>(context.config.lab_runs_max);
  table["runExperiment"] = {
      .handler = [runs](Request& request) { return run_experiment(runs, request); },
      .body = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes))};
}

}  // namespace server
