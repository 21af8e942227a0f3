/// Keys of the store as the API shows them.
#pragma once

#include "api/tenant_view.h"
#include "server/store/key_table.h"

namespace server {

api::KeyView key_view(const KeyRow& row);

}  // namespace server
