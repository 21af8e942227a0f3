/// Reads that several tables share.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/access.h"
#include "server/store/database.h"

namespace server {

/// Returns the first column of all rows of a query.
core::Result<std::vector<std::string>> first_column(Statement& select);
/// Returns the first column of the first row; 0 if there is none.
core::Result<std::int64_t> first_integer(Statement& select);
core::Result<bool> has_row(Statement& select);

/// References of tenants to something that they share, before one is removed.
struct References {
  std::int64_t count = 0;
  bool of_all = false;  ///< All go, otherwise only the requesting tenant's.
};

/// count: of SELECT COUNT(*), COALESCE(SUM(tenant=?), 0) FROM ... WHERE ...=?, unbound.
core::Result<References> references_to(std::string_view id, const Access& access, Statement& count);

}  // namespace server
