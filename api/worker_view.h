/// Workers: what they report, what they are asked to do, and how they are shown.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/job_spec.h"
#include "api/json.h"
#include "api/problem.h"

namespace api {

/// PUT /v1/workers/{id}: the worker lives, and what it is busy with.
struct WorkerReport {
  std::string build;
  std::string arithmetic;
  int threads = 1;
  bool draining = false;                ///< takes no more units
  std::map<std::string, double> units;  ///< CPU seconds spent on each that it holds
};
Parsed<WorkerReport> parse_worker_report(std::string_view body);

/// The answer to a report.
struct WorkerOrders {
  std::string reason;  ///< empty: it gets units
  double report_seconds = 1;
  std::vector<std::string> dropped;  ///< units whose results nobody wants any more
};
std::string worker_orders_json(const WorkerOrders& orders);

/// POST of a lease, and handing a unit back.
struct UnitRequest {
  std::string worker;
  std::string fault;  ///< why a unit that is handed back failed; empty: it did not
};
Parsed<UnitRequest> parse_unit_request(std::string_view body);

/// What a worker fetches for a job.
struct WorkInputs {
  JobSpec spec;
  std::map<std::string, std::string> files;  ///< uri to asset id; "" is the document itself. Empty:
                                             ///< the scene is built in
};
std::string work_inputs_json(const WorkInputs& inputs);

struct WorkerView {
  std::string id;
  std::string build;
  std::string arithmetic;
  int threads = 0;
  double rate = 0;  ///< pixel samples a second
  int leases = 0;
  std::int64_t units = 0;
  std::int64_t faults = 0;
  std::string state;
  std::string reason;  ///< why it is unsuitable; empty: it is not
  double seen_at_unix_seconds = 0;
};
std::string worker_list_json(std::span<const WorkerView> workers);

/// A tile of a job that a worker renders now.
struct WorkerTile {
  std::string worker;
  core::PixelRect rect;  ///< in pixels of the full film
};
std::string worker_tiles_json(std::span<const WorkerTile> tiles);

/// Adds the schemas of all of these to `components`.
void add_worker_schemas(Json& components);

}  // namespace api
