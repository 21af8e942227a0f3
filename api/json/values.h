/// Single JSON values: checked reading, text for messages, schemas. The field tables
/// (api/json/fields.h) use these.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <nlohmann/json.hpp>

#include "api/json/faults.h"
#include "api/json/json.h"
#include "core/color/rgb.h"
#include "core/math/place.h"
#include "core/math/vec.h"

namespace api {

/// Both ends are allowed values unless marked open.
struct Range {
  double min = 0;
  double max = 0;
  bool min_open = false;
  bool max_open = false;

  bool contains(double value) const noexcept;
  /// "[1, 16384]", "(0, 8]".
  std::string text() const;
};

struct TextRule {
  std::int64_t min_characters = 0;
  std::int64_t max_characters = 255;
};

/// "a string", "null", "an object".
std::string_view type_text(const Json& value);
/// Returns UTF-8 text of at most that many bytes, with "..." if it was cut.
std::string cut_text(std::string text, std::size_t bytes_max);
/// Returns the value as JSON, cut after 60 bytes.
std::string shown(const Json& value);
/// Returns the number of characters (code points) of UTF-8 text.
std::int64_t character_count(std::string_view utf8);

/// Each function adds a fault and returns nothing if the value does not match its description. This
/// one reads a whole number; 3.0 counts as one.
std::optional<std::int64_t> read_integer(const Json& value, const Range& range,
                                         const std::string& pointer, Faults& faults);
/// Negative zero becomes zero.
std::optional<double> read_number(const Json& value, const Range& range, const std::string& pointer,
                                  Faults& faults);
/// Control characters are refused.
std::optional<std::string> read_text(const Json& value, const TextRule& rule,
                                     const std::string& pointer, Faults& faults);
std::optional<bool> read_flag(const Json& value, const std::string& pointer, Faults& faults);
/// Reads an array of three numbers.
std::optional<core::Place> read_triple(const Json& value, const Range& range,
                                       const std::string& pointer, Faults& faults);
/// Reads six hexadecimal digits of sRGB; each channel in [0,1], as displayed.
std::optional<core::Rgb> read_color(std::string_view text, const std::string& pointer,
                                    Faults& faults);
/// Returns true for an object; otherwise adds a fault.
bool expect_object(const Json& value, const std::string& pointer, Faults& faults);
/// Adds a fault for each member that is not in `known`.
void refuse_unknown_members(const Json& object, std::span<const std::string_view> known,
                            const std::string& pointer, Faults& faults);
/// Returns "Unknown value 'x'; expected one of: a, b".
std::string not_available(const Json& value, std::span<const std::string_view> available);

/// Returns null for an empty text.
Json text_or_null(std::string_view text);
/// Whole numbers are written without a fraction.
Json number_json(double value);
Json number_json(float value);
Json triple_json(core::Vec3 value);
Json triple_json(core::Place value);
/// Prints a position that counts from the scene's origin in the file's coordinates.
Json place_json(core::Vec3 position, core::Place origin);

/// {"type": type, "description": doc}; nullable adds "null" to the type.
Json basic_schema(std::string_view type, std::string_view doc, bool nullable = false);
void add_range(Json& schema, const Range& range);
Json triple_schema(std::string_view doc, const Range& range, bool nullable);

}  // namespace api
