/// Keys of the store as returned by the API.
#pragma once

#include "api/answers/tenant_view.h"
#include "server/store/key_table.h"

namespace server {

api::KeyView key_view(const KeyRow& row);

}  // namespace server
