/// Rows of field tables (api/json/fields.h): each reads, checks, prints and documents one member of
/// a JSON object that represents a plain struct S. A row has
///   name()                                   the member
///   required()                               whether the member must be present
///   read(value, S&, pointer, Faults&)        called if the member is present
///   print(const S&, Json& object)            adds the member
///   schema(const S& defaults, Json& properties)   adds its JSON schema
/// Rows access their value through an accessor: &S::width, or, for a part of a part,
/// [](auto& s) -> auto& { return s.film.width; }, which works for const and mutable structs. An
/// accessor of std::optional makes the member nullable.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/json/faults.h"
#include "api/json/json.h"
#include "api/json/values.h"
#include "core/color/rgb.h"

namespace api {

/// Marks the schema of a member that is not always printed; removed before the document is
/// complete.
inline constexpr const char* kMayBeAbsent = "x-may-be-absent";

template <typename T>
struct OptionalOf {
  using Value = T;
  static constexpr bool kNullable = false;
};
template <typename T>
struct OptionalOf<std::optional<T>> {
  using Value = T;
  static constexpr bool kNullable = true;
};

/// Members common to all rows. Get: the accessor.
template <typename Get>
struct RowBase {
  std::string_view key;
  Get accessor;
  std::string_view doc;

  constexpr std::string_view name() const { return key; }
  static constexpr bool required() { return false; }

  template <typename S>
  using Member = OptionalOf<std::remove_cvref_t<std::invoke_result_t<const Get&, S&>>>;

  template <typename S>
  auto& get(S& s) const {
    return std::invoke(accessor, s);
  }

  /// Returns true if the value was a permitted null, which it has then read.
  template <typename S>
  bool read_null(const Json& value, S& out) const {
    if constexpr (Member<S>::kNullable) {
      if (value.is_null()) {
        get(out).reset();
        return true;
      }
    }
    return false;
  }
  template <typename S>
  const typename Member<S>::Value* value_of(const S& s) const {
    if constexpr (Member<S>::kNullable) {
      const auto& held = get(s);
      return held ? &*held : nullptr;
    } else {
      return &get(s);
    }
  }
};

template <typename Get>
struct NumberRow : RowBase<Get> {
  Range range;

  template <typename S>
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    using Value = typename RowBase<Get>::template Member<S>::Value;
    if (this->read_null(value, out)) {
      return;
    }
    if constexpr (std::is_integral_v<Value>) {
      if (const auto number = read_integer(value, range, pointer, faults)) {
        this->get(out) = static_cast<Value>(*number);
      }
    } else {
      if (const auto number = read_number(value, range, pointer, faults)) {
        this->get(out) = static_cast<Value>(*number);
      }
    }
  }
  template <typename S>
  void print(const S& s, Json& object) const {
    using Value = typename RowBase<Get>::template Member<S>::Value;
    const Value* value = this->value_of(s);
    if (value == nullptr) {
      object[std::string(this->key)] = nullptr;
    } else if constexpr (std::is_integral_v<Value>) {
      object[std::string(this->key)] = *value;
    } else {
      object[std::string(this->key)] = number_json(*value);
    }
  }
  template <typename S>
  void schema(const S& defaults, Json& properties) const {
    using Held = typename RowBase<Get>::template Member<S>;
    Json made = basic_schema(std::is_integral_v<typename Held::Value> ? "integer" : "number",
                             this->doc, Held::kNullable);
    add_range(made, range);
    Json shown_default;
    print(defaults, shown_default);
    made["default"] = shown_default[std::string(this->key)];
    properties[std::string(this->key)] = std::move(made);
  }
};

template <typename Get>
struct TextRow : RowBase<Get> {
  TextRule rule;
  bool must_be_there = false;

  constexpr bool required() const { return must_be_there; }
  template <typename S>
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    if (this->read_null(value, out)) {
      return;
    }
    if (auto text = read_text(value, rule, pointer, faults)) {
      this->get(out) = std::move(*text);
    }
  }
  template <typename S>
  void print(const S& s, Json& object) const {
    const std::string* value = this->value_of(s);
    object[std::string(this->key)] = value == nullptr ? Json(nullptr) : Json(*value);
  }
  template <typename S>
  void schema(const S& defaults, Json& properties) const {
    Json made = basic_schema("string", this->doc, RowBase<Get>::template Member<S>::kNullable);
    if (rule.min_characters > 0) {
      made["minLength"] = rule.min_characters;
    }
    made["maxLength"] = rule.max_characters;
    if (!must_be_there) {
      const std::string* value = this->value_of(defaults);
      made["default"] = value == nullptr ? Json(nullptr) : Json(*value);
    }
    properties[std::string(this->key)] = std::move(made);
  }
};

template <typename Get>
struct FlagRow : RowBase<Get> {
  template <typename S>
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    if (const auto flag = read_flag(value, pointer, faults)) {
      this->get(out) = *flag;
    }
  }
  template <typename S>
  void print(const S& s, Json& object) const {
    object[std::string(this->key)] = this->get(s);
  }
  template <typename S>
  void schema(const S& defaults, Json& properties) const {
    Json made = basic_schema("boolean", this->doc);
    made["default"] = this->get(defaults);
    properties[std::string(this->key)] = std::move(made);
  }
};

/// Reads core::Vec3, core::Place or core::Rgb as an array of three numbers.
template <typename Get>
struct TripleRow : RowBase<Get> {
  Range range;

  template <typename S>
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    using Value = typename RowBase<Get>::template Member<S>::Value;
    using Number = std::remove_cvref_t<decltype(std::declval<Value>()[0])>;
    if (this->read_null(value, out)) {
      return;
    }
    if (const auto triple = read_triple(value, range, pointer, faults)) {
      this->get(out) = Value{static_cast<Number>(triple->x), static_cast<Number>(triple->y),
                             static_cast<Number>(triple->z)};
    }
  }
  template <typename S>
  void print(const S& s, Json& object) const {
    const auto* value = this->value_of(s);
    object[std::string(this->key)] =
        value == nullptr ? Json(nullptr)
                         : Json::array({number_json((*value)[0]), number_json((*value)[1]),
                                        number_json((*value)[2])});
  }
  template <typename S>
  void schema(const S& defaults, Json& properties) const {
    Json made = triple_schema(this->doc, range, RowBase<Get>::template Member<S>::kNullable);
    Json shown_default;
    print(defaults, shown_default);
    made["default"] = shown_default[std::string(this->key)];
    properties[std::string(this->key)] = std::move(made);
  }
};

/// Reads one of the names of a registry. entries(): rows with `name`, and `value` unless the name
/// itself is stored.
template <typename Get, typename Entries>
struct ChoiceRow : RowBase<Get> {
  Entries entries;

  std::vector<std::string_view> names() const {
    std::vector<std::string_view> all;
    for (const auto& entry : entries()) {
      all.push_back(entry.name);
    }
    return all;
  }
  template <typename S>
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    if (!value.is_string()) {
      faults.add(pointer, "expected a string, got " + std::string(type_text(value)));
      return;
    }
    for (const auto& entry : entries()) {
      if (entry.name == value.template get_ref<const std::string&>()) {
        if constexpr (requires { entry.value; }) {
          this->get(out) = entry.value;
        } else {
          this->get(out) = std::string(entry.name);
        }
        return;
      }
    }
    faults.add(pointer, not_available(value, names()));
  }
  template <typename S>
  void print(const S& s, Json& object) const {
    Json& printed = object[std::string(this->key)];
    const auto* value = this->value_of(s);
    if (value == nullptr) {
      return;
    }
    for (const auto& entry : entries()) {
      if constexpr (requires { entry.value; }) {
        if (entry.value == *value) {
          printed = entry.name;
        }
      } else {
        printed = *value;
      }
    }
  }
  template <typename S>
  void schema(const S& defaults, Json& properties) const {
    Json made = basic_schema("string", this->doc);
    made["enum"] = names();
    Json shown_default;
    print(defaults, shown_default);
    made["default"] = shown_default[std::string(this->key)];
    properties[std::string(this->key)] = std::move(made);
  }
};

/// A row with its own functions.
template <typename S>
struct CustomRow {
  std::string_view key;
  void (*read_value)(const Json& value, S& out, const std::string& pointer, Faults& faults);
  void (*print_value)(const S& s, Json& object);
  Json (*make_schema)(const S& defaults);
  bool must_be_there = false;
  bool may_be_absent = false;  ///< print_value does not always add the member

  constexpr std::string_view name() const { return key; }
  constexpr bool required() const { return must_be_there; }
  void read(const Json& value, S& out, const std::string& pointer, Faults& faults) const {
    read_value(value, out, pointer, faults);
  }
  void print(const S& s, Json& object) const { print_value(s, object); }
  void schema(const S& defaults, Json& properties) const {
    Json made = make_schema(defaults);
    if (may_be_absent) {
      made[kMayBeAbsent] = true;
    }
    properties[std::string(key)] = std::move(made);
  }
};

}  // namespace api
