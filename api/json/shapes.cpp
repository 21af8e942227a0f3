#include "api/json/shapes.h"

#include <string>

#include "api/json/values.h"

namespace api::shape {

Json text(std::string_view doc) { return basic_schema("string", doc); }

Json count(std::string_view doc) {
  Json made = basic_schema("integer", doc);
  made["minimum"] = 0;
  return made;
}

Json integer(std::string_view doc) { return basic_schema("integer", doc); }
Json real(std::string_view doc) { return basic_schema("number", doc); }
Json flag(std::string_view doc) { return basic_schema("boolean", doc); }

Json time(std::string_view doc) {
  Json made = basic_schema("string", doc);
  made["format"] = "date-time";
  return made;
}

Json one_of(const std::vector<std::string_view>& names, std::string_view doc) {
  Json made = basic_schema("string", doc);
  made["enum"] = names;
  return made;
}

Json bias() {
  return one_of({"none", "consistent", "biased"},
                "How the expected value of the image relates to the true image.");
}

Json list(Json items, std::string_view doc) {
  Json made = basic_schema("array", doc);
  made["items"] = std::move(items);
  return made;
}

Json texts(std::string_view doc) { return list(text(), doc); }
Json reals(std::string_view doc) { return list(nullable(real()), doc); }

namespace {

Json reals_of(std::size_t length, std::string_view doc) {
  Json made = list(real(), doc);
  made["minItems"] = length;
  made["maxItems"] = length;
  return made;
}

}  // namespace

Json interval(std::string_view doc) { return reals_of(2, doc); }
Json triple(std::string_view doc) { return reals_of(3, doc); }

Json map(Json values, std::string_view doc) {
  Json made = basic_schema("object", doc);
  made["additionalProperties"] = std::move(values);
  return made;
}

Json object(std::string_view doc) { return basic_schema("object", doc); }

Json reference(std::string_view component) {
  return {{"$ref", "#/components/schemas/" + std::string(component)}};
}

Json nullable(Json shape) {
  if (!shape.contains("type")) {
    return {{"anyOf", Json::array({std::move(shape), {{"type", "null"}}})}};
  }
  shape["type"] = Json::array({shape["type"], "null"});
  if (shape.contains("enum")) {
    shape["enum"].push_back(nullptr);
  }
  return shape;
}

}  // namespace api::shape
