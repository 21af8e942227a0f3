#include "server/store/columns.h"

namespace server {

core::Result<std::vector<std::string>> first_column(Statement& select) {
  std::vector<std::string> column;
  while (select.step()) {
    column.push_back(select.text(0));
  }
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  return column;
}

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
