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
};

/// Returns empty for headers that are not understood, which libassimp refuses.
std::optional<Header> header_of(std::string_view text) {
  Header out;
  Lines lines(text);
  while (lines.next()) {
    const auto words = words_of(lines.line());
    const std::string_view keyword = words.empty() ? std::string_view() : words[0];
    if (keyword == "end_header") {
      out.body = lines.rest();
      out.lines = lines.number();
      return out;
    }
    if (keyword == "format" && words.size() > 1) {
      out.format = words[1];
    } else if (keyword == "element" && words.size() == 3) {
      Element& element = out.elements.emplace_back();
      element.name = words[1];
      const char* const end = words[2].data() + words[2].size();
      if (std::from_chars(words[2].data(), end, element.count).ptr != end) {
        return std::nullopt;
      }
    } else if (keyword == "property") {
      const bool is_list = words.size() == 5 && words[1] == "list";
      if (out.elements.empty() || !(is_list || words.size() == 3)) {
        return std::nullopt;
      }
      const std::string_view name = words.back();
      const Property property = {name, type_of(words[words.size() - 2]),
                                 is_list ? type_of(words[2]) : nullptr,
                                 !is_list && out.elements.back().name == "vertex" &&
                                     (name == "x" || name == "y" || name == "z")};
      if (property.type == nullptr || (is_list && property.count == nullptr)) {
        return std::nullopt;
      }
      out.elements.back().properties.push_back(property);
    }
  }
  return std::nullopt;
}

/// The values of a body, one after the other.
class Values {
 public:
  explicit Values(const Header& header)
      : rest_(header.body),
        is_text_(header.format == "ascii"),
        is_swapped_((header.format == "binary_big_endian") ==
                    (std::endian::native == std::endian::little)),
        line_(header.lines) {}

  /// Empty at the end of the file, and for words that are no numbers.
  std::optional<double> next(const Type& type) { return is_text_ ? next_word() : next_bytes(type); }
  bool is_text() const { return is_text_; }
  bool is_at_end() const { return is_at_end_; }
  std::size_t line() const { return line_; }

  /// count: a whole number, at least 0.
  bool skip(const Type& type, double count) {
    const std::size_t bytes = is_text_ ? 1 : type.bytes;  // of a value, at least
    is_at_end_ = count > static_cast<double>(rest_.size() / bytes);
    if (is_at_end_) {
      return false;
    }
    auto left = static_cast<std::size_t>(count);
    if (!is_text_) {
      rest_.remove_prefix(left * type.bytes);
      return true;
    }
    for (; left > 0; --left) {
      if (!next_word()) {
        return false;
      }
    }
    return true;
  }

 private:
  std::optional<double> next_word() {
    while (!rest_.empty() && std::isspace(static_cast<unsigned char>(rest_.front())) != 0) {
      line_ += rest_.front() == '\n' ? 1U : 0U;
      rest_.remove_prefix(1);
    }
    is_at_end_ = rest_.empty();
    double value = 0;
    rest_.remove_prefix(rest_.starts_with('+') ? 1 : 0);
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error == std::errc::invalid_argument) {
      return std::nullopt;
    }
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return error == std::errc() ? value : std::numeric_limits<double>::infinity();
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

  std::string_view rest_;
  bool is_text_;
  bool is_swapped_;
  bool is_at_end_ = false;
  std::size_t line_;
};

/// Reads one row; false: not as the header says. fault: why, if a coordinate is not finite.
bool read_row(const Element& element, Values& values, std::string& fault) {
  for (const Property& property : element.properties) {
    const auto value = values.next(property.count != nullptr ? *property.count : *property.type);
    if (!value) {
      return false;
    }
    if (property.count != nullptr && (!(*value >= 0) || !values.skip(*property.type, *value))) {
      return false;
    }
    if (property.is_coordinate && !std::isfinite(*value)) {
      fault = "a coordinate is not a finite number";
      return false;
    }
  }
  return true;
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
  const auto header = header_of(text_of(file));
  if (!header) {
    return text_of(file).find("end_header") == std::string_view::npos
               ? "the file ends before its header does"
               : "";
  }
  if (std::string fault = check_header(*header, notes); !fault.empty()) {
    return fault;
  }
  Values values(*header);
  for (const Element& element : header->elements) {
    for (std::uint64_t row = 0; row < element.count && !element.properties.empty(); ++row) {
      std::string fault;
      if (read_row(element, values, fault)) {
        continue;
      }
      const std::string of = std::to_string(row + 1) + " of the " + std::to_string(element.count) +
                             " of element " + element.name;
      if (!fault.empty()) {
        return (values.is_text() ? "line " + std::to_string(values.line() + 1) : "row " + of) +
               ": " + fault;
      }
      return values.is_at_end() ? "the file ends in row " + of : "";
    }
  }
  return "";
}

}  // namespace core
