// Workers: the list, and the requests of `tessera worker`.

#include <algorithm>
#include <string>
#include <utility>

#include "api/answers/worker_view.h"
#include "api/json/limits.h"
#include "core/scene_io/builtin_scenes.h"
#include "server/http/file_response.h"
#include "server/jobs/work_board.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;
using core::Status;

Response without_queue(const Request& request) {
  return error_answer(request, ErrorCode::kConflict,
                      "this server has no workers; they need `tessera serve --queue`");
}

Response list_workers(const RouteContext& context, Request& request) {
  const WorkBoard* board = context.jobs.board();
  auto workers = board == nullptr ? std::vector<api::WorkerView>() : board->workers();
  for (api::WorkerView& worker : workers) {
    // A worker's own words may name jobs and files of any tenant.
    if (request.access.sees_all() && !worker.last_fault.empty()) {
      worker.reason += ": " + worker.last_fault;
    }
    std::erase_if(worker.held, [&](const std::string& unit) {
      return !context.jobs.find(unit.substr(0, unit.find('.')), request.access);
    });
  }
  return json_response(200, api::worker_list_json(workers));
}

Response worker_tiles(const RouteContext& context, Request& /*request*/, const JobPointer& job) {
  const WorkBoard* board = context.jobs.board();
  return json_response(200, api::worker_tiles_json(board == nullptr ? std::vector<api::WorkerTile>()
                                                                    : board->tiles_of(*job)));
}

Response report(const RouteContext& context, Request& request) {
  const auto told = api::parse_worker_report(request.body);
  if (!told) {
    return problem_answer(request, told.problem());
  }
  WorkBoard* board = context.jobs.board();
  if (board == nullptr) {
    return without_queue(request);
  }
  const auto orders =
      board->report({std::string(request.path_param("id")), request.principal}, *told);
  return orders ? json_response(200, api::worker_orders_json(*orders))
                : error_answer(request, orders.error());
}

/// Returns the inputs of a job, of which a worker with the request's key holds a unit.
core::Result<api::WorkInputs> inputs_of(const RouteContext& context, const Request& request) {
  const std::string id(request.path_param("id"));
  WorkBoard* board = context.jobs.board();
  const JobPointer job = board == nullptr ? nullptr : board->job_of_lease(id, request.principal);
  if (!job) {
    return Error{ErrorCode::kNotFound, "no unit of job \"" + id + "\" is leased to this key", ""};
  }
  api::WorkInputs inputs{.spec = job->record().view.spec, .files = {}};
  if (core::find_builtin_scene(inputs.spec.scene) == nullptr) {
    auto files = context.scenes.files(inputs.spec.scene);
    if (!files) {
      return files.error();
    }
    inputs.files = *std::move(files);
  }
  return inputs;
}

Response inputs(const RouteContext& context, Request& request) {
  const auto found = inputs_of(context, request);
  return found ? json_response(200, api::work_inputs_json(*found))
               : error_answer(request, found.error());
}

Response file(const RouteContext& context, Request& request) {
  const auto found = inputs_of(context, request);
  if (!found) {
    return error_answer(request, found.error());
  }
  const std::string id(request.path_param("sha256"));
  const bool is_input = found->spec.environment_asset == id ||
                        std::any_of(found->files.begin(), found->files.end(),
                                    [&id](const auto& each) { return each.second == id; });
  if (!is_input) {
    return error_answer(request, ErrorCode::kNotFound, "the job does not need the file");
  }
  if (const Status whole = context.assets.check(id); !whole) {
    return error_answer(request, whole.error());
  }
  return file_response(request, {.path = context.assets.path_of(id)});
}

/// Calls work(board, unit, sender, parsed body).
template <typename Work>
Response on_unit(const RouteContext& context, Request& request, Work&& work) {
  const auto asked = api::parse_unit_request(request.body);
  if (!asked) {
    return problem_answer(request, asked.problem());
  }
  WorkBoard* board = context.jobs.board();
  return board == nullptr ? without_queue(request)
                          : work(*board, std::string(request.path_param("id")),
                                 WorkBoard::Sender{asked->worker, request.principal}, *asked);
}

/// Retry-After of a unit that is another worker's turn: the worker may ask for the next one.
Response again_at_once(Response response) {
  if (response.status == 503) {
    response.headers.set("Retry-After", "0");
  }
  return response;
}

Response lease(const RouteContext& context, Request& request) {
  return on_unit(context, request,
                 [&](WorkBoard& board, const std::string& unit, const WorkBoard::Sender& sender,
                     const auto& /*asked*/) {
                   auto work = board.lease(unit, sender);
                   return work ? bytes_response(
                                     200, "application/octet-stream",
                                     std::make_shared<const std::string>(*std::move(work)))
                               : again_at_once(error_answer(request, work.error()));
                 });
}

Response hand_back(const RouteContext& context, Request& request) {
  return on_unit(context, request,
                 [&](WorkBoard& board, const std::string& unit, const WorkBoard::Sender& sender,
                     const auto& asked) {
                   const auto status = board.hand_back(unit, sender, asked.fault);
                   return status ? empty_response() : error_answer(request, status.error());
                 });
}

Response result(const RouteContext& context, Request& request) {
  WorkBoard* board = context.jobs.board();
  if (board == nullptr) {
    return without_queue(request);
  }
  const std::string unit(request.path_param("id"));
  const WorkBoard::Sender sender = {std::string(request.path_param("worker")), request.principal};
  // A worker without a lease makes the server store nothing; the body is still read, so that the
  // connection can be reused.
  const auto most = board->result_bytes_max(unit, sender);
  if (!most) {
    return request.body_reader->read([](std::string_view) { return true; })
               ? error_answer(request, most.error())
               : error_answer(request, ErrorCode::kInvalidArgument, "the body is cut short");
  }
  const std::uint64_t declared = request.body_reader->declared_bytes().value_or(0);
  const auto too_large = [&] {
    return error_answer(request, ErrorCode::kTooLarge,
                        "the unit's result has at most " + std::to_string(*most) + " bytes");
  };
  if (declared > *most) {
    return too_large();
  }
  auto lease = context.memory.take(declared, "the result");
  if (!lease) {
    return error_answer(request, lease.error());
  }
  std::string body;
  body.reserve(static_cast<std::size_t>(declared));
  Status room = core::ok_status();
  const bool is_whole = request.body_reader->read([&](std::string_view piece) {
    const std::uint64_t size = body.size() + piece.size();
    if (room && size > declared) {  // chunked transfer encoding
      room = lease->grow(piece.size());
    }
    if (room && size <= *most) {
      body.append(piece);
    }
    return room && size <= *most;
  });
  if (!room) {
    return error_answer(request, room.error());
  }
  if (!is_whole) {
    return too_large();
  }
  const auto taken = board->take(unit, sender, body);
  return taken ? empty_response() : again_at_once(error_answer(request, taken.error()));
}

}  // namespace

void add_work_handlers(HandlerTable& table) {
  const BodyPolicy json = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes));
  table["listWorkers"] = {.handler = &list_workers};
  table["listWorkerTiles"] = {.of_job = &worker_tiles};
  table["reportWorker"] = {.handler = &report, .body = json};
  table["getWorkInputs"] = {.handler = &inputs};
  table["getWorkFile"] = {.handler = &file};
  table["leaseUnit"] = {.handler = &lease, .body = json};
  table["putUnitResult"] = {.handler = &result, .body = BodyPolicy::stream(kResultBytesMax)};
  table["handBackUnit"] = {.handler = &hand_back, .body = json};
}

}  // namespace server
