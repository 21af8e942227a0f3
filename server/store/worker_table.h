/// Workers that returned wrong results: they stay suspended when the server starts again.
#pragma once

#include <set>
#include <string>

#include "core/base/result.h"
#include "server/store/database.h"

namespace server {

class WorkerTable {
 public:
  /// Of more suspended workers, those suspended first are forgotten: as many as may report
  /// (server/workers/lease_table.cpp). A worker that starts again has another id.
  static constexpr int kMost = 10'000;

  /// database must outlive this.
  explicit WorkerTable(Database& database) : database_(database) {}

  core::Status suspend(const std::string& worker);
  core::Result<std::set<std::string>> suspended() const;

 private:
  Database& database_;
};

}  // namespace server
