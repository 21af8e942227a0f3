/// UsageTable: what each tenant has, over all tables.
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
  double cpu_seconds = 0;  ///< Those of deleted jobs too.
  std::int64_t deleted_jobs = 0;
  std::int64_t film_bytes = 0;  ///< Room for films that are being rendered counts.
};

class UsageTable {
 public:
  /// database must outlive this.
  explicit UsageTable(Database& database) : database_(database) {}

  /// Every tenant that has a key or anything else, by name; of one who does not see all, only that
  /// one.
  core::Result<std::vector<UsageRow>> list(const Access& access);

 private:
  Database& database_;
};

}  // namespace server
