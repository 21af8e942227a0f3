/// The tables of the database, and migration of older files.
#pragma once

#include "core/base/result.h"
#include "server/store/database.h"

namespace server {

/// Returns the version that this build writes, which is stored in the file's user_version.
int schema_version();

/// Migrates the file to schema_version(), one migration per transaction. Errors: kInternal when the
/// file was written by a newer version.
core::Status migrate(Database& database);

}  // namespace server
