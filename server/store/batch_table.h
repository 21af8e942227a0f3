/// BatchTable: jobs submitted together. The state of a batch follows from its jobs.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/access.h"
#include "server/store/database.h"
#include "server/store/delivery_table.h"

namespace server {

struct BatchRow {
  std::int64_t sequence = 0;  ///< The newest has the highest; assigned by insert().
  std::string id;
  std::string tenant;  ///< The owner; empty: the operator.
  std::string name;
  std::string webhook;  ///< Called when all jobs have ended; empty: no call.
  double created_at = 0;
};

/// A job in its batch.
struct BatchJobRow {
  std::string id;
  std::string values;  ///< JSON text: the values that the matrix assigned to it.
};

class BatchTable {
 public:
  /// database must outlive this.
  explicit BatchTable(Database& database) : database_(database) {}

  /// Runs in the transaction that inserts the jobs. jobs: their sequences, in the order of the
  /// batch.
  static core::Status insert(Database::Session& session, const BatchRow& row,
                             const std::vector<std::int64_t>& jobs,
                             const std::vector<std::string>& values);
  /// Errors: kNotFound, also for one that `access` does not see.
  core::Result<BatchRow> find(std::string_view id, const Access& access);
  core::Result<std::vector<BatchJobRow>> jobs(const BatchRow& batch);
  /// Returns the ids of the jobs of its batch, in their order; none if it was submitted alone.
  core::Result<std::vector<std::string>> ids_beside(std::int64_t job);
  /// Returns the batches that `access` sees, newest first; only sequences below `before`.
  core::Result<std::vector<BatchRow>> list(std::optional<std::int64_t> before, int limit,
                                           const Access& access);

  /// Returns batches with a webhook whose jobs have all ended, and whose end has not been reported.
  /// job: only the batch of that job.
  core::Result<std::vector<BatchRow>> ended(const std::optional<std::string>& job);
  /// Reports the end by this delivery; no effect if it was reported before.
  core::Status report_end(const BatchRow& batch, const DeliveryRow& delivery);
  /// Records that jobs of the batch run again, so that its end is reported again.
  core::Status reopen(const BatchRow& batch);

 private:
  Database& database_;
};

}  // namespace server
