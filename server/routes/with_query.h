/// Handlers of operations with a query.
#pragma once

#include "api/requests.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"

namespace server {

/// Returns a handler that calls handle() with the parsed query, or answers its problem.
/// parse: from api::QueryParams to api::Parsed<Query>.
template <typename Parse, typename Query>
auto with_query(Parse parse, Response (*handle)(const RouteContext&, Request&, const Query&)) {
  return [parse, handle](const RouteContext& context, Request& request) {
    const auto query = parse(request.query_params);
    return query ? handle(context, request, *query) : problem_answer(request, query.problem());
  };
}

/// As above, of the job `{id}`; answers as find_job() if there is none.
template <typename Parse, typename Query>
auto with_query(Parse parse,
                Response (*handle)(const RouteContext&, Request&, const JobPointer&, const Query&),
                Needs needs = Needs::kJob) {
  return [parse, handle, needs](const RouteContext& context, Request& request) {
    const auto query = parse(request.query_params);
    if (!query) {
      return problem_answer(request, query.problem());
    }
    const auto job = find_job(context.jobs, request, needs);
    return job ? handle(context, request, *job, *query) : problem_answer(request, job.problem());
  };
}

}  // namespace server
