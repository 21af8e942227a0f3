/// Workers that returned wrong results: they stay suspended when the server starts again.
#pragma once

#include <set>
#include <string>

#include "core/base/result.h"
#include "server/store/database.h"

namespace server {

class WorkerTable {
 public:
  /// database must outlive this. most: of more suspended workers, those suspended first are
  /// forgotten: a worker that starts again has another id.
  WorkerTable(Database& database, int most) : database_(database), most_(most) {}

  core::Status suspend(const std::string& worker);
  core::Result<std::set<std::string>> suspended() const;

 private:
  Database& database_;
  const int most_;
};

}  // namespace server
