#include "api/json/values.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

#include "core/base/text.h"
#include "core/math/numbers.h"

namespace api {

bool Range::contains(double value) const noexcept {
  // Written so that NaN is outside.
  const bool above = min_open ? value > min : value >= min;
  const bool below = max_open ? value < max : value <= max;
  return above && below;
}

std::string Range::text() const {
  return (min_open ? "(" : "[") + number_text(min) + ", " + number_text(max) +
         (max_open ? ")" : "]");
}

std::string_view type_text(const Json& value) {
  switch (value.type()) {
    case Json::value_t::null:
      return "null";
    case Json::value_t::boolean:
      return "true or false";
    case Json::value_t::string:
      return "a string";
    case Json::value_t::array:
      return "an array";
    case Json::value_t::object:
      return "an object";
    default:
      return "a number";
  }
}

std::string cut_text(std::string text, std::size_t bytes_max) {
  if (text.size() > bytes_max) {
    std::size_t end = bytes_max;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) {
      --end;
    }
    text.resize(end);
    text += "...";
  }
  return text;
}

std::string shown(const Json& value) {
  constexpr std::size_t kLongest = 60;
  if (value.is_number_float()) {
    return number_text(value.get<double>());
  }
  std::string text = dump(value);
  if (value.is_string() && text.size() >= 2) {
    text.front() = '\'';
    text.back() = '\'';
  }
  return cut_text(std::move(text), kLongest);
}

std::int64_t character_count(std::string_view utf8) {
  return std::count_if(utf8.begin(), utf8.end(),
                       [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; });
}

std::optional<double> read_number(const Json& value, const Range& range, const std::string& pointer,
                                  Faults& faults) {
  if (!value.is_number()) {
    faults.add(pointer, "expected a number, got " + std::string(type_text(value)));
    return {};
  }
  const double number = value.get<double>() + 0.0;  // -0 + 0 is 0
  if (!range.contains(number)) {
    faults.add(pointer, shown(value) + " is outside " + range.text());
    return {};
  }
  return number;
}

std::optional<std::int64_t> read_integer(const Json& value, const Range& range,
                                         const std::string& pointer, Faults& faults) {
  if (!value.is_number()) {
    faults.add(pointer, "expected a whole number, got " + std::string(type_text(value)));
    return {};
  }
  const double number = value.get<double>();
  if (std::isfinite(number) && std::trunc(number) != number) {
    faults.add(pointer, shown(value) + " is not a whole number");
    return {};
  }
  // Every range ends below 2^53, so doubles represent each whole number exactly.
  if (!range.contains(number)) {
    faults.add(pointer, shown(value) + " is outside " + range.text());
    return {};
  }
  return static_cast<std::int64_t>(number);
}

std::optional<std::string> read_text(const Json& value, const TextRule& rule,
                                     const std::string& pointer, Faults& faults) {
  if (!value.is_string()) {
    faults.add(pointer, "expected a string, got " + std::string(type_text(value)));
    return {};
  }
  const auto& text = value.get_ref<const std::string&>();
  const std::int64_t count = character_count(text);
  if (count < rule.min_characters || count > rule.max_characters) {
    faults.add(pointer, count == 0 ? std::string("is empty")
                                   : "has " + std::to_string(count) + " characters, outside [" +
                                         std::to_string(rule.min_characters) + ", " +
                                         std::to_string(rule.max_characters) + "]");
    return {};
  }
  const auto is_control = [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20U || byte == 0x7FU;
  };
  if (std::any_of(text.begin(), text.end(), is_control)) {
    faults.add(pointer, "contains a control character");
    return {};
  }
  return text;
}

std::optional<bool> read_flag(const Json& value, const std::string& pointer, Faults& faults) {
  if (!value.is_boolean()) {
    faults.add(pointer, "expected true or false, got " + std::string(type_text(value)));
    return {};
  }
  return value.get<bool>();
}

std::optional<core::Place> read_triple(const Json& value, const Range& range,
                                       const std::string& pointer, Faults& faults) {
  constexpr std::size_t kCount = 3;
  if (!value.is_array() || value.size() != kCount) {
    faults.add(pointer, "expected an array of 3 numbers, got " +
                            (value.is_array() ? std::to_string(value.size()) + " elements"
                                              : std::string(type_text(value))));
    return {};
  }
  double numbers[kCount] = {};
  bool good = true;
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto number =
        read_number(value[i], range, join_pointer(pointer, std::to_string(i)), faults);
    good = good && number.has_value();
    numbers[i] = number.value_or(0);
  }
  if (!good) {
    return {};
  }
  return core::Place{numbers[0], numbers[1], numbers[2]};
}

std::optional<core::Rgb> read_color(std::string_view text, const std::string& pointer,
                                    Faults& faults) {
  std::uint32_t digits = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, fault] = std::from_chars(text.data(), end, digits, 16);
  if (text.size() != 6 || fault != std::errc() || stop != end) {
    faults.add(pointer, shown(Json(text)) + " is not a colour such as ffffff");
    return std::nullopt;
  }
  const auto channel = [digits](unsigned shift) {
    return static_cast<float>((digits >> shift) & 255U) / 255.0F;
  };
  return core::Rgb{channel(16), channel(8), channel(0)};
}

bool expect_object(const Json& value, const std::string& pointer, Faults& faults) {
  if (value.is_object()) {
    return true;
  }
  faults.add(pointer, "expected an object, got " + std::string(type_text(value)));
  return false;
}

void refuse_unknown_members(const Json& object, std::span<const std::string_view> known,
                            const std::string& pointer, Faults& faults) {
  for (const auto& member : object.items()) {
    if (std::find(known.begin(), known.end(), member.key()) != known.end()) {
      continue;
    }
    std::string detail = known.empty()
                             ? "Unknown field; no fields are allowed here"
                             : "Unknown field; expected one of: " + core::joined(known, ", ");
    const bool is_of_job = pointer.empty() || pointer.ends_with("/stop");
    if (is_of_job && (member.key() == "samples" || member.key() == "spp")) {
      detail += "; the number of samples is stop.samples_per_pixel";
    }
    faults.add(join_pointer(pointer, member.key()), std::move(detail));
  }
}

std::string not_available(const Json& value, std::span<const std::string_view> available) {
  return "Unknown value " + shown(value) + "; expected one of: " + core::joined(available, ", ");
}

Json text_or_null(std::string_view text) { return text.empty() ? Json(nullptr) : Json(text); }

Json number_json(double value) {
  if (std::abs(value) < core::kExactIntegers && std::trunc(value) == value) {
    return Json(static_cast<std::int64_t>(value));
  }
  return std::isfinite(value) ? Json(value) : Json(nullptr);
}

Json number_json(float value) { return number_json(shortest_double(value)); }

Json triple_json(core::Vec3 value) {
  return Json::array({number_json(value.x), number_json(value.y), number_json(value.z)});
}

Json triple_json(core::Place value) {
  return Json::array({number_json(value.x), number_json(value.y), number_json(value.z)});
}

Json place_json(core::Vec3 position, core::Place origin) {
  // Floats are printed short, so that a scene without an origin reads as it was written.
  return origin == core::Place{} ? triple_json(position)
                                 : triple_json(core::Place(position) + origin);
}

Json basic_schema(std::string_view type, std::string_view doc, bool nullable) {
  Json schema;
  schema["type"] = nullable ? Json::array({type, "null"}) : Json(type);
  if (!doc.empty()) {
    schema["description"] = doc;
  }
  return schema;
}

void add_range(Json& schema, const Range& range) {
  schema[range.min_open ? "exclusiveMinimum" : "minimum"] = number_json(range.min);
  schema[range.max_open ? "exclusiveMaximum" : "maximum"] = number_json(range.max);
}

Json triple_schema(std::string_view doc, const Range& range, bool nullable) {
  Json schema = basic_schema("array", doc, nullable);
  Json item = basic_schema("number", "");
  add_range(item, range);
  schema["items"] = std::move(item);
  schema["minItems"] = 3;
  schema["maxItems"] = 3;
  return schema;
}

}  // namespace api
