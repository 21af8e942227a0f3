#include "server/store/columns.h"

namespace server {

core::Result<std::vector<std::string>> first_column(Statement& select) {
  return select.rows([](const Statement& row) { return row.text(0); });
}

core::Result<std::int64_t> first_integer(Statement& select) {
  return select.result(select.step() ? select.integer(0) : 0);
}

core::Result<bool> has_row(Statement& select) { return select.result(select.step()); }

core::Result<References> references_to(std::string_view id, const Access& access,
                                       Statement& count) {
  count.bind(access.tenant).bind(id);
  References found;
  bool has_own = false;
  if (count.step()) {
    found.count = count.integer(0);
    has_own = count.integer(1) > 0;
  }
  if (const auto status = count.status(); !status) {
    return status.error();
  }
  found.of_all = access.is_shared() || (access.sees_all() && !has_own);
  return found;
}

}  // namespace server
