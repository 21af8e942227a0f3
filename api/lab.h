/// The laboratory's requests and answers: POST /v1/lab/runs, and `experiments` of GET /v1/server.
///
/// An answer is JSON lines: one object for each n as it is done, then one with the outcome. The
/// same request gives the same bytes but for the members that are times: `seconds` and
/// `efficiency`.
#pragma once

#include <string>
#include <string_view>

#include "api/json.h"
#include "api/problem.h"
#include "core/lab/run.h"

namespace api {

/// Independent repetitions unless the request says otherwise.
inline constexpr int kLabReplicatesDefault = 64;

struct LabRequest {
  core::lab::Setup setup;
  core::lab::RunOptions options;
};
/// 400 broken JSON, 413 too large, 422 with pointers. What is not given is the experiment's
/// default.
Parsed<LabRequest> parse_lab_request(std::string_view body);

/// {"n", "n_asked", "mean", "rmse", "standard_error", "cost", "seconds"}, without a line break.
std::string lab_point_json(const core::lab::Point& point);
struct LabOutcomeView {
  const LabRequest& request;
  const core::lab::Outcome& outcome;
};
/// The outcome with the request that led to it, all defaults filled in.
std::string lab_outcome_json(const LabRequest& request, const core::lab::Outcome& outcome);
/// The last line when the server stops before the outcome.
std::string lab_cancelled_json();
/// Every experiment with its texts, estimators, parameters and defaults.
Json experiments_json();

Json lab_request_schema();

}  // namespace api
