/// The tables of the database and how an older file becomes a newer one.
#pragma once

#include "core/base/result.h"
#include "server/store/database.h"

namespace server {

/// The version that this build writes; kept in the file's user_version.
int schema_version();

/// Brings the file up to schema_version(), one migration a transaction.
/// Errors: kInternal when the file was made by a newer version.
core::Status migrate(Database& database);

}  // namespace server
