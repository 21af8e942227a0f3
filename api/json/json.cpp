#include "api/json/json.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <unordered_set>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/json/errors.h"
#include "api/json/limits.h"
#include "core/math/numbers.h"

namespace api {
namespace {

/// Builds the value and checks depth, repeated members and number range. nlohmann's own builder
/// keeps the last of two equal members and has no depth limit.
class Builder {
 public:
  explicit Builder(std::string_view text) : text_(text) {}

  // NOLINTBEGIN(readability-identifier-naming): names that the parser asks for
  using number_integer_t = Json::number_integer_t;
  using number_unsigned_t = Json::number_unsigned_t;
  using number_float_t = Json::number_float_t;
  using string_t = Json::string_t;
  using binary_t = Json::binary_t;
  // NOLINTEND(readability-identifier-naming)

  bool null() { return add(nullptr); }
  bool boolean(bool value) { return add(value); }
  bool number_integer(number_integer_t value) { return add(value); }
  bool number_unsigned(number_unsigned_t value) { return add(value); }
  bool number_float(number_float_t value, const string_t& /*text*/) { return add(value); }
  bool string(string_t& value) { return add(std::move(value)); }
  bool binary(binary_t& /*value*/) { return false; }

  bool start_object(std::size_t /*size*/) { return open(Json::object()); }
  bool end_object() { return close(); }
  bool start_array(std::size_t /*size*/) { return open(Json::array()); }
  bool end_array() { return close(); }

  bool key(string_t& name) {
    Level& level = levels_.back();
    if (name.size() > static_cast<std::size_t>(limits::kJsonKeyBytes)) {
      return refuse(
          core::ErrorCode::kInvalidArgument, here(),
          "has a member name longer than " + std::to_string(limits::kJsonKeyBytes) + " bytes");
    }
    if (!level.keys.insert(name).second) {
      return refuse(core::ErrorCode::kInvalidArgument, join_pointer(here(), name),
                    "appears more than once");
    }
    level.key = name;
    return true;
  }

  bool parse_error(std::size_t position, const std::string& last_token,
                   const nlohmann::json::exception& exception) {
    // 406: a number such as 1e999, which is well-formed JSON.
    if (exception.id == 406) {
      return refuse(core::ErrorCode::kInvalidArgument, next_place(),
                    last_token.substr(0, 40) + " is too large for a number");
    }
    const std::size_t offset = position == 0 ? 0 : position - 1;
    if (text_.find_first_not_of(" \t\r\n") == std::string_view::npos) {
      problem_ = make_problem(core::ErrorCode::kBadSyntax, "The body is empty; JSON was expected.");
      return false;
    }
    problem_ = make_problem(core::ErrorCode::kBadSyntax,
                            "The body is not JSON: " + reason(exception.what()) + " at byte " +
                                std::to_string(offset) + ".");
    return false;
  }

  Json take() { return std::move(root_); }
  const Problem& problem() const { return problem_; }

 private:
  struct Level {
    Json value;
    std::string key;  ///< of the member being read
    std::unordered_set<std::string> keys;
  };

  /// Removes from "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error
  /// while ...; last read: ..." the parts that name the library.
  static std::string reason(std::string what) {
    if (const auto bracket = what.find("] "); bracket != std::string::npos) {
      what.erase(0, bracket + 2);
    }
    if (const auto colon = what.find(": ");
        what.starts_with("parse error") && colon != std::string::npos) {
      what.erase(0, colon + 2);
    }
    if (const auto last = what.find("; last read"); last != std::string::npos) {
      what.erase(last);
    }
    constexpr std::size_t kLongest = 160;
    return what.substr(0, kLongest);
  }

  std::string here() const {
    std::string pointer;
    for (std::size_t i = 0; i + 1 < levels_.size(); ++i) {
      pointer = join_pointer(pointer, step(levels_[i]));
    }
    return pointer;
  }
  std::string next_place() const {
    return levels_.empty() ? std::string() : join_pointer(here(), step(levels_.back()));
  }
  static std::string step(const Level& level) {
    return level.value.is_array() ? std::to_string(level.value.size()) : level.key;
  }

  bool refuse(core::ErrorCode code, std::string pointer, std::string detail) {
    problem_ = make_problem(code, {{std::move(pointer), std::move(detail)}});
    return false;
  }

  bool add(Json value) {
    if (levels_.empty()) {
      root_ = std::move(value);
      return true;
    }
    Level& level = levels_.back();
    if (level.value.is_array()) {
      level.value.push_back(std::move(value));
    } else {
      // Not operator[], which searches all members each time: the key is known to be new.
      auto& members = level.value.get_ref<Json::object_t&>();
      members.emplace_back(std::move(level.key), std::move(value));
      level.key.clear();
    }
    return true;
  }
  bool open(Json value) {
    if (static_cast<std::int64_t>(levels_.size()) >= limits::kJsonDepth) {
      return refuse(core::ErrorCode::kInvalidArgument, next_place(),
                    "is nested deeper than " + std::to_string(limits::kJsonDepth) + " levels");
    }
    levels_.push_back(Level{std::move(value), {}, {}});
    return true;
  }
  bool close() {
    Json value = std::move(levels_.back().value);
    levels_.pop_back();
    return add(std::move(value));
  }

  std::string_view text_;
  std::vector<Level> levels_;
  Json root_;
  Problem problem_;
};

}  // namespace

std::string dump(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Parsed<Json> parse_json(std::string_view text, std::size_t bytes_max) {
  if (text.size() > bytes_max) {
    return make_problem(core::ErrorCode::kTooLarge,
                        "The body has " + std::to_string(text.size()) + " bytes; at most " +
                            std::to_string(bytes_max) + " are allowed.");
  }
  Builder builder(text);
  if (!Json::sax_parse(text.begin(), text.end(), &builder)) {
    return builder.problem();
  }
  return builder.take();
}

double shortest_double(float value) {
  if (!std::isfinite(value)) {
    return static_cast<double>(value);
  }
  std::array<char, 32> text{};
  const auto written = std::to_chars(text.data(), text.data() + text.size(), value);
  double shortest = 0;
  std::from_chars(text.data(), written.ptr, shortest);
  // Rounding twice, to double and then to float, could give another float.
  return static_cast<float>(shortest) == value ? shortest : static_cast<double>(value);
}

std::string number_text(double value) {
  std::array<char, 40> text{};
  char* const end = text.data() + text.size();
  const bool whole = std::abs(value) <= core::kExactIntegers && std::trunc(value) == value;
  const auto written = whole ? std::to_chars(text.data(), end, static_cast<std::int64_t>(value))
                             : std::to_chars(text.data(), end, value);
  return {text.data(), written.ptr};
}

std::string join_pointer(std::string_view pointer, std::string_view key) {
  std::string joined(pointer);
  joined += '/';
  for (const char c : key) {
    if (c == '~') {
      joined += "~0";
    } else if (c == '/') {
      joined += "~1";
    } else {
      joined += c;
    }
  }
  return joined;
}

}  // namespace api
