/// Flags that set one member of the job request to their value, as rows; the API checks the value.
/// Members without a row are set by --set. Ranges and defaults are those of the request's schema,
/// which this library cannot link; tests compare them.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "core/base/result.h"

namespace cli {

using Json = nlohmann::ordered_json;

struct MemberFlag {
  enum class Value {
    kText,
    kNumber,
    kShare,  ///< a number, or a percentage
    kTrue,   ///< a switch
    kFalse   ///< a switch
  };
  const char* names;
  const char* pointer;  ///< of the member
  Value value;
  const char* placeholder;  ///< of the value, in help
  const char* text;
  const char* standard = "";  ///< the default, in help
  double min = 0;             ///< of numbers and shares
  double max = 0;             ///< at min: any number; the server tells the range
  bool is_open = false;       ///< min itself is not allowed
};

/// Rules that end a job.
std::span<const MemberFlag> stop_flags();
/// Camera, environment, background and ground.
std::span<const MemberFlag> view_flags();
/// How light is followed and sampled.
std::span<const MemberFlag> method_flags();

/// The members that were set, in order.
struct MemberValue {
  std::string pointer;
  Json value;
};
using MemberValues = std::vector<MemberValue>;

/// values: gets those of the flags; must outlive the app. has_standards: help includes the
/// defaults.
void add_member_flags(CLI::App& app, std::span<const MemberFlag> flags, MemberValues& values,
                      bool has_standards = true);
/// --set MEMBER=VALUE, for every member of the request, such as integrator.max_depth=4.
void add_set_option(CLI::App& app, MemberValues& values);

/// Sets the member; objects on the way are made, or replace other values.
void put(Json& request, std::string_view pointer, Json value);
void put(Json& request, const MemberValues& values);

}  // namespace cli
