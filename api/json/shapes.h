/// Shapes of response members: JSON schemas (2020-12) by kind. `doc` becomes the description.
#pragma once

#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/json/json.h"

namespace api::shape {

Json text(std::string_view doc = "");
/// At least 0.
Json count(std::string_view doc = "");
Json integer(std::string_view doc = "");
Json real(std::string_view doc = "");
Json flag(std::string_view doc = "");
/// RFC 3339.
Json time(std::string_view doc = "");
Json one_of(const std::vector<std::string_view>& names, std::string_view doc = "");
/// "none", "consistent" or "biased".
Json bias();
Json list(Json items, std::string_view doc = "");
Json texts(std::string_view doc = "");
/// Numbers; NaN is null.
Json reals(std::string_view doc = "");
/// Lower and upper end.
Json interval(std::string_view doc = "");
/// Three numbers.
Json triple(std::string_view doc = "");
/// An object with arbitrary names and members of one shape.
Json map(Json values, std::string_view doc = "");
/// An object whose members are not described.
Json object(std::string_view doc = "");
Json reference(std::string_view component);
/// The shape or null.
Json nullable(Json shape);

}  // namespace api::shape
