/// The part of JSON Schema 2020-12 that our documents use, as a checker for tests.
#pragma once

#include <string>

#include "api/json.h"

namespace test_api {

/// "" if `value` is valid against `schema`, else the pointer and what is wrong. `root` holds what
/// "$ref" names. CHECK-fails on a keyword it does not know, so that none is silently not checked.
std::string schema_fault(const api::Json& value, const api::Json& schema, const api::Json& root,
                         const std::string& pointer = "");

}  // namespace test_api
