#include "core/scene_io/assimp/check_ply.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "core/base/text.h"
#include "core/scene_io/assimp/words.h"

namespace core {
namespace {

enum class Kind { kSigned, kUnsigned, kFloat };
struct Type {
  std::string_view name;
  std::size_t bytes;
  Kind kind;
};
/// G. Turk, The PLY Polygon File Format, 1994, and the names with sizes that replaced them.
constexpr std::array kTypes = {
    Type{"char", 1, Kind::kSigned},     Type{"int8", 1, Kind::kSigned},
    Type{"uchar", 1, Kind::kUnsigned},  Type{"uint8", 1, Kind::kUnsigned},
    Type{"short", 2, Kind::kSigned},    Type{"int16", 2, Kind::kSigned},
    Type{"ushort", 2, Kind::kUnsigned}, Type{"uint16", 2, Kind::kUnsigned},
    Type{"int", 4, Kind::kSigned},      Type{"int32", 4, Kind::kSigned},
    Type{"uint", 4, Kind::kUnsigned},   Type{"uint32", 4, Kind::kUnsigned},
    Type{"float", 4, Kind::kFloat},     Type{"float32", 4, Kind::kFloat},
    Type{"double", 8, Kind::kFloat},    Type{"float64", 8, Kind::kFloat}};

const Type* type_of(std::string_view name) {
  const auto* const found =
      std::find_if(kTypes.begin(), kTypes.end(), [&](const Type& row) { return row.name == name; });
  return found == kTypes.end() ? nullptr : found;
}

struct Property {
  std::string_view name;
  const Type* type = nullptr;
  const Type* count = nullptr;  ///< of a list
  bool is_coordinate = false;
  bool is_corners = false;  ///< a list of vertices
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::string_view format;
  std::vector<Element> elements;
  std::string_view body;
  std::size_t lines = 0;

  std::uint64_t vertices() const {
    const auto found = std::find_if(elements.begin(), elements.end(),
                                    [](const Element& each) { return each.name == "vertex"; });
    return found == elements.end() ? 0 : found->count;
  }
};

/// Adds a line of the header; false: it is not understood.
bool add_line(const std::vector<std::string_view>& words, Header& to) {
  const std::string_view keyword = words[0];
  if (keyword == "format") {
    to.format = words.size() > 1 ? words[1] : keyword;
    return to.format == "ascii" || to.format == "binary_little_endian" ||
           to.format == "binary_big_endian";
  }
  if (keyword == "element") {
    Element& element = to.elements.emplace_back();
    const std::string_view count = words.size() == 3 ? words[2] : std::string_view();
    element.name = words.size() == 3 ? words[1] : std::string_view();
    const char* const end = count.data() + count.size();
    return !count.empty() && std::from_chars(count.data(), end, element.count).ptr == end;
  }
  if (keyword == "property") {
    const bool is_list = words.size() == 5 && words[1] == "list";
    if (to.elements.empty() || !(is_list || words.size() == 3)) {
      return false;
    }
    Element& element = to.elements.back();
    const std::string_view name = words.back();
    const Property property = {
        name, type_of(words[words.size() - 2]), is_list ? type_of(words[2]) : nullptr,
        !is_list && element.name == "vertex" && (name == "x" || name == "y" || name == "z"),
        is_list && element.name == "face" && (name == "vertex_index" || name == "vertex_indices")};
    element.properties.push_back(property);
    return property.type != nullptr && (!is_list || property.count != nullptr);
  }
  return keyword == "ply" || keyword == "comment" || keyword == "obj_info";
}

/// Returns an error text; empty: none. libassimp hangs or crashes on headers that it does not
/// understand.
std::string read_header(std::string_view text, Header& to) {
  for (Lines lines(text); lines.next();) {
    const auto words = words_of(lines.line());
    if (lines.number() == 1 && (words.empty() || in_lower_case(words[0]) != "ply")) {
      return "it does not begin with ply";
    }
    if (!words.empty() && words[0] == "end_header") {
      to.body = lines.rest();
      to.lines = lines.number();
      return "";
    }
    const bool is_last = lines.rest().empty();  // and may be half a line
    if (lines.number() > 1 && !words.empty() && !add_line(words, to) && !is_last) {
      constexpr std::size_t kShown = 80;  // bytes
      return "line " + std::to_string(lines.number()) +
             " of its header is not understood: " + std::string(lines.line().substr(0, kShown));
    }
  }
  return "the file ends before its header does";
}

/// The values of a body, one after the other.
class Values {
 public:
  explicit Values(const Header& header)
      : lines_(header.body),
        rest_(header.body),
        is_text_(header.format == "ascii"),
        is_swapped_((header.format == "binary_big_endian") ==
                    (std::endian::native == std::endian::little)),
        line_(header.lines) {}

  /// Goes to the next row, which in text is a line, as libassimp reads it; false at the end.
  bool next_row() {
    bool is_there = !is_text_;
    while (!is_there && lines_.next()) {
      row_ = trimmed(lines_.line());
      is_there = !row_.empty();
    }
    is_at_end_ = !is_there;
    return is_there;
  }
  /// Empty at the end of the file or row, and for words that are no numbers.
  std::optional<double> next(const Type& type) { return is_text_ ? next_word() : next_bytes(type); }
  bool is_text() const { return is_text_; }
  bool is_at_end() const { return is_at_end_; }
  std::size_t line() const { return line_ + lines_.number(); }

  /// count: a whole number, at least 0.
  bool skip(const Type& type, double count) {
    if (is_text_) {
      while (count-- > 0) {
        if (!next_word()) {
          return false;
        }
      }
      return true;
    }
    is_at_end_ = count > static_cast<double>(rest_.size() / type.bytes);
    if (!is_at_end_) {
      rest_.remove_prefix(static_cast<std::size_t>(count) * type.bytes);
    }
    return !is_at_end_;
  }

 private:
  std::optional<double> next_word() {
    row_.remove_prefix(std::min(row_.find_first_not_of(kSpaces), row_.size()));
    const std::string_view word = row_.substr(0, row_.find_first_of(kSpaces));
    row_.remove_prefix(word.size());
    is_at_end_ = word.empty() && lines_.rest().empty();
    return number_in(word);
  }

  template <typename T>
  static double as(const std::array<char, 8>& bytes) {
    T value;
    std::memcpy(&value, bytes.data(), sizeof(T));
    return static_cast<double>(value);
  }

  std::optional<double> next_bytes(const Type& type) {
    is_at_end_ = rest_.size() < type.bytes;
    if (is_at_end_) {
      return std::nullopt;
    }
    std::array<char, 8> bytes{};
    for (std::size_t i = 0; i < bytes.size() && i < type.bytes; ++i) {
      bytes[i] = rest_[is_swapped_ ? type.bytes - 1 - i : i];
    }
    rest_.remove_prefix(type.bytes);
    switch (type.kind) {
      case Kind::kFloat:
        return type.bytes == 4 ? as<float>(bytes) : as<double>(bytes);
      case Kind::kSigned:
        return type.bytes == 1   ? as<std::int8_t>(bytes)
               : type.bytes == 2 ? as<std::int16_t>(bytes)
                                 : as<std::int32_t>(bytes);
      case Kind::kUnsigned:
        break;
    }
    return type.bytes == 1   ? as<std::uint8_t>(bytes)
           : type.bytes == 2 ? as<std::uint16_t>(bytes)
                             : as<std::uint32_t>(bytes);
  }

  Lines lines_;            ///< of text
  std::string_view row_;   ///< its rest
  std::string_view rest_;  ///< of a binary body
  bool is_text_;
  bool is_swapped_;
  bool is_at_end_ = false;
  std::size_t line_;  ///< the last of the header
};

/// Findings in faces.
struct Faces {
  std::uint64_t vertices = 0;  ///< of the file
  std::size_t short_ones = 0;
};

/// Reads a list of vertices. Returns an error text; empty: none, or the file ends.
std::string read_corners(const Property& property, double count, Values& values, Faces& faces) {
  if (count == 0) {
    return "a face has no corners";  // libassimp fails on some of these
  }
  faces.short_ones += count < 3 ? 1U : 0U;
  for (; count > 0; --count) {
    const auto index = values.next(*property.type);
    if (!index) {
      return values.is_at_end() ? "" : "a face has fewer corners than it says";
    }
    if (!(*index >= 0 && *index < static_cast<double>(faces.vertices))) {
      constexpr double kWhole = 1e15;  // Doubles hold whole numbers up to here.
      return "a face names vertex " +
             (std::abs(*index) < kWhole ? std::to_string(static_cast<std::int64_t>(*index))
                                        : std::string("beyond")) +
             ", counted from 0, of " + std::to_string(faces.vertices);
    }
  }
  return "";
}

/// Reads one row. Returns an error text; empty: none, or the file ends.
std::string read_row(const Element& element, Values& values, Faces& faces) {
  if (!values.next_row()) {
    return "";
  }
  for (const Property& property : element.properties) {
    const bool is_list = property.count != nullptr;
    const auto value = values.next(is_list ? *property.count : *property.type);
    if (!value) {
      return values.is_at_end() ? "" : "its values are not the numbers that the header names";
    }
    if (property.is_coordinate && !is_in_float(*value)) {
      return "a coordinate is not a finite number";
    }
    if (is_list && !(*value >= 0)) {
      return "a list has less than no values";
    }
    if (property.is_corners) {
      std::string fault = read_corners(property, *value, values, faces);
      if (!fault.empty() || values.is_at_end()) {
        return fault;
      }
    } else if (is_list && !values.skip(*property.type, *value)) {
      return values.is_at_end() ? "" : "a list has fewer values than it says";
    }
  }
  return "";
}

/// Returns an error text for headers that libassimp takes for something else; empty: none.
std::string check_header(const Header& header, std::vector<std::string>& notes) {
  for (const Element& element : header.elements) {
    const auto has = [&](std::string_view name) {
      return std::any_of(element.properties.begin(), element.properties.end(),
                         [&](const Property& property) { return property.name == name; });
    };
    const bool has_float_count = std::any_of(
        element.properties.begin(), element.properties.end(), [](const Property& property) {
          return property.count != nullptr && property.count->kind == Kind::kFloat;
        });
    if (has_float_count) {
      return "a list of element " + element.name + " has a float for the number of its values";
    }
    if (element.properties.empty() && element.count > 0) {
      return "element " + element.name + " has no properties";
    }
    if (element.name == "tristrips" && element.count > 0) {
      return "its triangles are in strips (tristrips), which are not read";  // libassimp keeps one
    }
    if (element.name == "vertex" && !(has("x") && has("y") && has("z"))) {
      return "its vertices have no x, y and z";
    }
    if (element.name == "face" && has("red")) {
      notes.emplace_back("PLY: the colours of faces are left out.");
    }
    if (element.name == "face" && has("texcoord")) {
      notes.emplace_back("PLY: of the texture coordinates of a vertex's corners one is taken.");
    }
  }
  return "";
}

}  // namespace

std::string check_ply(const Bytes& file, std::vector<std::string>& notes) {
  Header header;
  std::string fault = read_header(text_of(file), header);
  fault = fault.empty() ? check_header(header, notes) : fault;
  if (!fault.empty()) {
    return fault;
  }
  Values values(header);
  Faces faces{header.vertices()};
  for (const Element& element : header.elements) {
    for (std::uint64_t row = 0; row < element.count; ++row) {
      fault = read_row(element, values, faces);
      if (fault.empty() && !values.is_at_end()) {
        continue;
      }
      const std::string of = std::to_string(row + 1) + " of the " + std::to_string(element.count) +
                             " of element " + element.name;
      return fault.empty()      ? "the file ends in row " + of
             : values.is_text() ? "line " + std::to_string(values.line()) + ": " + fault
                                : "row " + of + ": " + fault;
    }
  }
  if (faces.short_ones > 0) {
    notes.push_back("Faces of fewer than three corners are left out: " +
                    std::to_string(faces.short_ones) + ".");
  }
  return "";
}

}  // namespace core
