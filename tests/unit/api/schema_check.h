/// Checks JSON values in tests against the subset of JSON Schema 2020-12 that our documents use.
#pragma once

#include <string>

#include "api/json/json.h"

namespace test_api {

/// Returns "" if `value` is valid against `schema`, else the pointer and the error. `root` resolves
/// "$ref". CHECK-fails on an unknown keyword, so that every keyword is checked.
std::string schema_fault(const api::Json& value, const api::Json& schema, const api::Json& root,
                         const std::string& pointer = "");

}  // namespace test_api
