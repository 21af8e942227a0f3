/// The laboratory's requests and responses: POST /v1/lab/runs, and `experiments` of GET /v1/server.
///
/// A response consists of JSON lines: one object for each completed n, then one with the outcome.
/// Equal requests give equal bytes except for the members that are times: `seconds` and
/// `efficiency`.
#pragma once

#include <string>
#include <string_view>

#include "api/json/json.h"
#include "api/problem.h"
#include "core/lab/run.h"

namespace api {

/// Default number of independent repetitions.
inline constexpr int kLabReplicatesDefault = 64;

struct LabRequest {
  core::lab::Setup setup;
  core::lab::RunOptions options;
};
/// Problems: 400 invalid JSON, 413 too large, 422 with pointers. Omitted members take the
/// experiment's defaults.
Parsed<LabRequest> parse_lab_request(std::string_view body);

/// {"n", "n_asked", "mean", "rmse", "standard_error", "cost", "seconds"}, without a line break.
std::string lab_point_json(const core::lab::Point& point);
struct LabOutcomeView {
  const LabRequest& request;
  const core::lab::Outcome& outcome;
};
/// Returns the outcome with its request, all defaults filled in.
std::string lab_outcome_json(const LabRequest& request, const core::lab::Outcome& outcome);
/// Returns the last line when the server stops before the outcome.
std::string lab_cancelled_json();
/// Returns every experiment with its texts, estimators, parameters and defaults.
Json experiments_json();

Json lab_request_schema();

}  // namespace api
