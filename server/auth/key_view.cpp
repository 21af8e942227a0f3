#include "server/auth/key_view.h"

namespace server {

api::KeyView key_view(const KeyRow& row) {
  api::KeyView view{.id = row.id,
                    .name = row.name,
                    .tenant = row.tenant,
                    .scopes = {},
                    .rate_limit = row.rate_limit,
                    .max_priority = row.priority_max,
                    .created_at_unix_seconds = row.created_at,
                    .expires_at_unix_seconds = row.expires_at};
  if (row.may_read) {
    view.scopes.emplace_back("read");
  }
  if (row.may_write) {
    view.scopes.emplace_back("write");
  }
  if (row.may_admin) {
    view.scopes.emplace_back("admin");
  }
  if (row.may_work) {
    view.scopes.emplace_back("worker");
  }
  return view;
}

}  // namespace server
