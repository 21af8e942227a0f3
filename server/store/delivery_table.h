/// DeliveryTable: pending webhook calls, and the outcomes of earlier ones.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/access.h"
#include "server/store/database.h"

namespace server {

struct DeliveryRow {
  std::int64_t sequence = 0;  ///< The newest has the highest; assigned by insert().
  std::string id;
  std::string tenant = {};  ///< The owner; empty: the operator.
  std::string job = {};     ///< Empty: a test.
  std::string event;        ///< "state", "end", "test".
  std::string url;
  std::string receiver = {};  ///< Calls to one receiver are made one after another.
  std::string body;
  std::string state = "pending";  ///< Or "delivered", "failed".
  int attempts = 0;
  double created_at = 0;                ///< Seconds since 1970, as all times here.
  double next_at = 0;                   ///< While it is pending.
  std::optional<double> ended_at = {};  ///< When it was delivered or given up.
  int status = 0;                       ///< Status of the last response; 0: none.
  std::string detail = {};              ///< Why the last attempt failed.
};

/// Inserts the calls in the transaction that causes them. Receivers follow from tenants and
/// addresses.
core::Status insert_deliveries(Database::Session& session, const std::vector<DeliveryRow>& rows);

struct DeliveryQuery {
  std::string job = {};    ///< Empty: all jobs.
  std::string state = {};  ///< Empty: all states.
  std::optional<std::int64_t> before = {};
  int limit = 50;
};

class DeliveryTable {
 public:
  /// database must outlive this.
  explicit DeliveryTable(Database& database) : database_(database) {}

  core::Status insert(const DeliveryRow& row);
  /// Returns the first due call of each receiver, for at most that many receivers per tenant. A
  /// call waits while an earlier one of the same job to the same address does.
  core::Result<std::vector<DeliveryRow>> due(double now, int receivers_of_tenant);
  /// Makes calls due that wait for longer than `wait` seconds after so many attempts, because the
  /// clock was ahead when they were planned.
  core::Status bring_forward(int attempts, double now, double wait);
  /// Records the outcome of an attempt: state, attempts, times, status and detail of the row.
  core::Status update(const DeliveryRow& row);
  /// Makes the call pending again, due at once. Errors: kNotFound, also for a call that `access`
  /// does not see.
  core::Status send_again(std::string_view id, const Access& access, double now);
  /// Errors: kNotFound, also for a call that `access` does not see.
  core::Result<DeliveryRow> find(std::string_view id, const Access& access);
  /// Returns the calls that `access` sees, newest first.
  core::Result<std::vector<DeliveryRow>> list(const DeliveryQuery& query, const Access& access);
  core::Result<std::int64_t> pending_count();
  /// Removes calls that ended before that time.
  core::Status forget_before(double ended_at);

  /// Returns the tenant's secret; stores `fresh` if there is none.
  core::Result<std::string> secret(std::string_view tenant, const std::string& fresh);
  core::Status replace_secret(std::string_view tenant, std::string_view secret);

 private:
  Database& database_;
};

}  // namespace server
