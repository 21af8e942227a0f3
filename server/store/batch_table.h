/// Batches: which jobs were made together. What they have come to follows from their jobs.
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
  std::int64_t sequence = 0;  ///< Newest has the highest; given by insert().
  std::string id;
  std::string tenant;  ///< Empty: the operator's.
  std::string name;
  std::string webhook;  ///< Called when all jobs have ended; empty: no call.
  double created_at = 0;
};

/// A job in its batch.
struct BatchJobRow {
  std::string id;
  std::string values;  ///< JSON text: what the matrix gave it.
};

class BatchTable {
 public:
  /// database must outlive this.
  explicit BatchTable(Database& database) : database_(database) {}

  /// In the transaction that makes the jobs. jobs: their sequences, in the order of the batch.
  static core::Status insert(Database::Session& session, const BatchRow& row,
                             const std::vector<std::int64_t>& jobs,
                             const std::vector<std::string>& values);
  /// Errors: kNotFound, also for one that `access` does not see.
  core::Result<BatchRow> find(std::string_view id, const Access& access);
  core::Result<std::vector<BatchJobRow>> jobs(const BatchRow& batch);
  /// Newest first, of what `access` sees; only sequences below `before`.
  core::Result<std::vector<BatchRow>> list(std::optional<std::int64_t> before, int limit,
                                           const Access& access);

  /// Batches with a webhook whose jobs have all ended, and whose end has not been reported. job:
  /// only the batch of that one.
  core::Result<std::vector<BatchRow>> ended(const std::optional<std::string>& job);
  /// The end is reported by this call; nothing happens where it was before.
  core::Status report_end(const BatchRow& batch, const DeliveryRow& delivery);
  /// Its jobs go on: the end is reported again.
  core::Status reopen(const BatchRow& batch);

 private:
  Database& database_;
};

}  // namespace server
