/// UsageTable: usage of each tenant, over all tables.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "server/access.h"
#include "server/store/database.h"

namespace server {

struct UsageRow {
  std::string tenant;  ///< Empty: the operator.
  std::int64_t jobs = 0;
  std::int64_t unfinished_jobs = 0;
  double cpu_seconds = 0;  ///< Includes deleted jobs.
  std::int64_t deleted_jobs = 0;
  std::int64_t film_bytes = 0;  ///< Includes the reserved size of films that are being rendered.
};

class UsageTable {
 public:
  /// database must outlive this.
  explicit UsageTable(Database& database) : database_(database) {}

  /// Returns every tenant that has a key or anything else, by name; without access to all tenants,
  /// only the own one.
  core::Result<std::vector<UsageRow>> list(const Access& access);

 private:
  Database& database_;
};

}  // namespace server
