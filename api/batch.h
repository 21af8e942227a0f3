/// Batches: a template and a matrix of values become jobs.
///
/// {"template": job, "matrix": {"camera.orbit.theta_degrees": [0, 30], "variant": ["a", "b"]},
///  "name": "{variant}-{theta_degrees}", "webhook": {"url"}}. Each key of the matrix is the path of
/// a member of the job request; the last one changes fastest. Values that are objects are merged
/// into the member (RFC 7396), others replace it. In names, {KEY} stands for a value: KEY is a path
/// of the matrix or its last part, or the path of any other member; {index} counts from 1.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/answers/job_view.h"
#include "api/job/job_spec.h"
#include "api/json/json.h"
#include "api/problem.h"
#include "api/requests.h"

namespace api {

struct BatchJob {
  std::string name;    ///< unique within the batch
  std::string values;  ///< JSON text of an object: its value for each key of the matrix
  ParsedJob job;
  /// Origins of its values: pointer in the job, pointer in the request.
  std::vector<std::pair<std::string, std::string>> origins;
};

struct BatchRequest {
  std::string name;  ///< the pattern
  std::optional<Webhook> webhook;
  std::vector<BatchJob> jobs;
};

/// POST /v1/batches. Problems: 400, 413, 422 at /matrix, /name, /template; of several invalid jobs,
/// the first is reported.
Parsed<BatchRequest> parse_batch(std::string_view body);

/// Converts a problem of one of its jobs, with pointers into the request.
Problem batch_problem(Problem problem, const BatchJob& job);

/// GET /v1/batches/{id}/archive.zip and /sheet.png.
struct BatchPicturesQuery {
  std::string format = "png";  ///< extension; only for the archive
  ImageQuery look;
};
Parsed<BatchPicturesQuery> parse_archive_query(QueryParams query,
                                               std::span<const std::string> tone_maps);
Parsed<BatchPicturesQuery> parse_sheet_query(QueryParams query,
                                             std::span<const std::string> tone_maps);
/// GET /v1/batches?cursor=&limit=.
Parsed<ListQuery> parse_batch_list_query(QueryParams query);
/// POST /v1/batches?dry_run=1.
Parsed<bool> parse_batch_submit_query(QueryParams query);

struct BatchMember {
  std::string id;
  std::string name;
  std::string values;  ///< JSON text
  JobState state = JobState::kQueued;
  double fraction = 0;
  std::uint32_t revision = 0;  ///< of its image; 0: there is none yet
  double cpu_seconds = 0;
  std::optional<core::Flicker> flicker = {};  ///< of its image of a video
};

struct BatchView {
  std::string id;
  std::string name;
  double created_at_unix_seconds = 0;
  std::vector<BatchMember> jobs;  ///< not empty
  std::vector<std::string> damaged =
      {};  ///< those whose records cannot be read; among `jobs` failed
};

/// Returns queued if no job has begun; rendering while some have not ended; paused if all
/// unfinished ones are paused; then failed, cancelled or finished: the first of these that any job
/// has.
std::string_view batch_state(const BatchView& batch);
std::string batch_json(const BatchView& batch);
/// The list omits the jobs of each batch.
std::string batch_list_json(std::span<const BatchView> batches,
                            const std::optional<std::string>& next);
/// Returns the jobs that the request would create.
std::string batch_dry_run_json(const BatchRequest& request);
/// Returns the body of the webhook call at the end.
std::string batch_webhook_body(double unix_seconds, const BatchView& batch);

void add_batch_schemas(Json& components);

}  // namespace api
