/// Workers: their reports, the orders for them, and their view.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/job/job_spec.h"
#include "api/json/json.h"
#include "api/problem.h"

namespace api {

/// PUT /v1/workers/{id}: reports that the worker is alive, and its units.
struct WorkerReport {
  std::string build;
  std::string arithmetic;
  int threads = 1;
  bool draining = false;                ///< takes no more units
  std::map<std::string, double> units;  ///< CPU seconds spent on each unit that it holds
};
Parsed<WorkerReport> parse_worker_report(std::string_view body);

/// The response to a report.
struct WorkerOrders {
  std::string reason;  ///< why it gets no units; empty: it gets units
  double report_seconds = 1;
  std::vector<std::string> dropped;  ///< units whose results are no longer needed
};
std::string worker_orders_json(const WorkerOrders& orders);

/// Body of POST for a lease, and for returning a unit.
struct UnitRequest {
  std::string worker;
  std::string fault;  ///< why a returned unit failed; empty: it did not
};
Parsed<UnitRequest> parse_unit_request(std::string_view body);

/// Inputs of a job that a worker fetches.
struct WorkInputs {
  JobSpec spec;
  std::map<std::string, std::string>
      files;  ///< maps uri to asset id; "" is the document. Empty: a built-in scene
};
std::string work_inputs_json(const WorkInputs& inputs);

struct WorkerView {
  std::string id;
  std::string build;
  std::string arithmetic;
  int threads = 0;
  double rate = 0;  ///< pixel samples per second
  int leases = 0;
  std::vector<std::string> held;  ///< names of the units of the leases
  std::int64_t units = 0;
  std::int64_t faults = 0;
  std::string state;
  std::string reason;      ///< why it gets no units; empty: it gets units
  std::string last_fault;  ///< why it rests, in its own words; not in the answer
  double seen_at_unix_seconds = 0;
};
std::string worker_list_json(std::span<const WorkerView> workers);

/// A tile of a job that a worker is rendering.
struct WorkerTile {
  std::string worker;
  core::PixelRect rect;  ///< in pixels of the full film
};
std::string worker_tiles_json(std::span<const WorkerTile> tiles);

/// Adds the schemas of this header to `components`.
void add_worker_schemas(Json& components);

}  // namespace api
