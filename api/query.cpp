#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include <nlohmann/json.hpp>

#include "api/errors.h"
#include "api/faults.h"
#include "api/limits.h"
#include "api/requests.h"
#include "api/values.h"
#include "core/render/registry.h"

namespace api {
namespace {

constexpr double kRevisionMax = std::numeric_limits<std::uint32_t>::max();

bool is_hex(char c) {
  return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
}

/// The whole text as a number; the grammar is that of JSON, so that "0x10", "inf" and " 5" are
/// none.
Json number_from_text(const std::string& text) {
  Json value = Json::parse(text, nullptr, /*allow_exceptions=*/false);
  const bool plain =
      !text.empty() && text.find_first_not_of("0123456789+-.eE") == std::string::npos;
  return plain && value.is_number() ? value : Json(text);
}

std::optional<std::int64_t> query_integer(const std::string& text, const Range& range,
                                          const std::string& pointer, Faults& faults) {
  return read_integer(number_from_text(text), range, pointer, faults);
}

/// Calls row(name, value) for each parameter; false means that there is no such one. Repeated ones
/// are refused unless named in `repeatable`.
template <typename Row>
void each_parameter(QueryParams query, std::span<const std::string_view> repeatable, Faults& faults,
                    const Row& row) {
  std::vector<std::string> seen;
  for (const auto& [name, value] : query) {
    const std::string pointer = join_pointer("", name);
    const bool repeated = std::find(seen.begin(), seen.end(), name) != seen.end();
    const bool may_repeat =
        std::find(repeatable.begin(), repeatable.end(), name) != repeatable.end();
    seen.push_back(name);
    if (repeated && !may_repeat) {
      faults.add(pointer, "is there more than once");
    } else if (!row(name, value, pointer)) {
      faults.add(pointer, "unknown query parameter");
    }
  }
}

void read_states(const std::string& text, ListQuery& out, const std::string& pointer,
                 Faults& faults) {
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string name = text.substr(begin, end - begin);
    if (const auto state = job_state_from_text(name)) {
      out.states.push_back(*state);
    } else {
      faults.add(pointer, shown(Json(name)) +
                              " is not a state; states: queued, loading, rendering, paused, "
                              "finished, failed, cancelled");
    }
    begin = end + 1;
  }
}

void read_label(const std::string& text, ListQuery& out, const std::string& pointer,
                Faults& faults) {
  const std::size_t equals = text.find('=');
  LabelFilter filter;
  filter.key = text.substr(0, equals);
  if (equals != std::string::npos) {
    filter.value = text.substr(equals + 1);
  }
  if (filter.key.empty() || out.labels.size() >= static_cast<std::size_t>(limits::kLabels)) {
    faults.add(pointer, filter.key.empty() ? shown(Json(text)) + " is not key=value"
                                           : std::string("too many labels"));
    return;
  }
  out.labels.push_back(std::move(filter));
}

void read_name(const std::string& text, ListQuery& out, const std::string& pointer, Faults& faults) {
  // The longest name, each character of it with the most bytes that UTF-8 has.
  constexpr std::size_t kLongest = 4 * static_cast<std::size_t>(limits::kNameCharacters);
  if (text.empty() || text.size() > kLongest) {
    faults.add(pointer, std::to_string(text.size()) + " bytes are outside [1, " + std::to_string(kLongest) + "]");
    return;
  }
  out.name = text;
}

void read_class(const std::string& text, ListQuery& out, const std::string& pointer, Faults& faults) {
  if (text == "normal") {
    out.job_class = JobClass::kNormal;
  } else if (text == "preview") {
    out.job_class = JobClass::kPreview;
  } else {
    faults.add(pointer, shown(Json(text)) + " is not a class; classes: normal, preview");
  }
}

void read_cursor(const std::string& text, ListQuery& out, const std::string& pointer,
                 Faults& faults) {
  constexpr std::size_t kLongest = 256;
  const auto allowed = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-' ||
           c == '_';
  };
  if (text.empty() || text.size() > kLongest || !std::all_of(text.begin(), text.end(), allowed)) {
    faults.add(pointer, shown(Json(text)) + " is not a cursor of this list");
    return;
  }
  out.cursor = text;
}

Parsed<ListQuery> parse_list_query(QueryParams query, bool has_filters) {
  ListQuery out;
  Faults faults;
  constexpr std::array<std::string_view, 2> kRepeatable = {"state", "label"};
  each_parameter(
      query, kRepeatable, faults,
      [&](const std::string& name, const std::string& value, const std::string& pointer) {
        if (name == "limit") {
          const Range range = {1, static_cast<double>(limits::kPageSize)};
          const auto limit = query_integer(value, range, pointer, faults);
          out.limit = static_cast<int>(limit.value_or(out.limit));
        } else if (name == "cursor") {
          read_cursor(value, out, pointer, faults);
        } else if (has_filters && name == "state") {
          read_states(value, out, pointer, faults);
        } else if (has_filters && name == "label") {
          read_label(value, out, pointer, faults);
        } else if (has_filters && name == "name") {
          read_name(value, out, pointer, faults);
        } else if (has_filters && name == "class") {
          read_class(value, out, pointer, faults);
        } else {
          return false;
        }
        return true;
      });
  if (!faults.empty()) {
    return make_problem(core::ErrorCode::kBadSyntax, faults.problem().errors);
  }
  return out;
}

template <typename T>
Parsed<T> checked(T value, const Faults& faults) {
  if (!faults.empty()) {
    return faults.problem();
  }
  return value;
}

/// x, y, width and height as they come in.
struct RectParts {
  std::array<std::optional<int>, 4> parts;
  static constexpr std::array<std::string_view, 4> kNames = {"x", "y", "width", "height"};

  bool take(const std::string& name, const std::string& value, const std::string& pointer,
            Faults& faults) {
    const auto* found = std::find(kNames.begin(), kNames.end(), name);
    if (found == kNames.end()) {
      return false;
    }
    const auto index = static_cast<std::size_t>(found - kNames.begin());
    const auto side = static_cast<double>(limits::kFilmSide);
    const Range range = index < 2 ? Range{0, side - 1} : Range{1, side};
    if (const auto number = query_integer(value, range, pointer, faults)) {
      parts[index] = static_cast<int>(*number);
    }
    return true;
  }
  /// All four or none.
  std::optional<core::PixelRect> rect(Faults& faults) const {
    const auto given = std::count_if(parts.begin(), parts.end(),
                                     [](const auto& part) { return part.has_value(); });
    if (given == 0 || !faults.empty()) {
      return {};
    }
    for (std::size_t i = 0; i < parts.size(); ++i) {
      if (!parts[i]) {
        faults.add("/" + std::string(kNames[i]),
                   "is required; x, y, width and height come together");
      }
    }
    if (!faults.empty()) {
      return {};
    }
    return core::PixelRect{*parts[0], *parts[1], *parts[2], *parts[3]};
  }
};

void read_layer(const std::string& value, ImageQuery& out, const std::string& pointer,
                Faults& faults) {
  std::vector<std::string_view> names;
  for (const core::LayerEntry& layer : core::layers()) {
    names.push_back(layer.name);
  }
  if (std::find(names.begin(), names.end(), value) == names.end()) {
    faults.add(pointer, not_available(Json(value), names));
  }
  out.layer = value;
}

// "auto", or two numbers with a comma between them.
void read_range(const std::string& value, ImageQuery& out, const std::string& pointer,
                Faults& faults) {
  if (value == "auto") {
    out.range = ImageRange{};
    return;
  }
  const auto comma = value.find(',');
  if (comma == std::string::npos) {
    faults.add(pointer, shown(Json(value)) + " is neither auto nor two numbers with a comma between");
    return;
  }
  constexpr auto kMost = static_cast<double>(std::numeric_limits<float>::max());
  const auto low = read_number(number_from_text(value.substr(0, comma)), {-kMost, kMost}, pointer, faults);
  const auto high = read_number(number_from_text(value.substr(comma + 1)), {-kMost, kMost}, pointer, faults);
  if (!low || !high) {
    return;
  }
  const std::array<float, 2> ends = {static_cast<float>(*low), static_cast<float>(*high)};
  if (!(ends[0] < ends[1])) {
    faults.add(pointer, "the first number must be below the second");
    return;
  }
  out.range = ImageRange{ends};
}

}  // namespace

Parsed<ListQuery> parse_job_list_query(QueryParams query) { return parse_list_query(query, true); }
Parsed<ListQuery> parse_scene_list_query(QueryParams query) {
  return parse_list_query(query, false);
}

Parsed<SubmitQuery> parse_submit_query(QueryParams query) {
  SubmitQuery out;
  Faults faults;
  each_parameter(
      query, {}, faults,
      [&](const std::string& name, const std::string& value, const std::string& pointer) {
        if (name == "dry_run") {
          out.dry_run = value == "1" || value == "true";
          if (!out.dry_run && value != "0" && value != "false") {
            faults.add(pointer, shown(Json(value)) + " is not 0, 1, false or true");
          }
        } else if (name == "from") {
          out.from_image = value == "image";
          if (!out.from_image) {
            faults.add(pointer, shown(Json(value)) + " is not 'image'");
          }
        } else {
          return false;
        }
        return true;
      });
  return checked(out, faults);
}

Parsed<WaitQuery> parse_wait_query(QueryParams query) {
  WaitQuery out;
  Faults faults;
  each_parameter(
      query, {}, faults,
      [&](const std::string& name, const std::string& value, const std::string& pointer) {
        if (name != "wait") {
          return false;
        }
        const Range range = {0, static_cast<double>(limits::kWaitSeconds)};
        out.wait_seconds = read_number(number_from_text(value), range, pointer, faults).value_or(0);
        return true;
      });
  return checked(out, faults);
}

std::optional<int> prefer_wait_seconds(std::string_view prefer_header) {
  const auto trim = [](std::string_view text) {
    const auto first = text.find_first_not_of(" \t");
    if (first == std::string_view::npos) {
      return std::string_view();
    }
    return text.substr(first, text.find_last_not_of(" \t") - first + 1);
  };
  while (!prefer_header.empty()) {
    const std::size_t end = std::min(prefer_header.find(','), prefer_header.size());
    std::string_view preference = trim(prefer_header.substr(0, end));
    prefer_header.remove_prefix(std::min(end + 1, prefer_header.size()));
    preference = trim(preference.substr(0, preference.find(';')));
    const std::size_t equals = preference.find('=');
    std::string name(trim(preference.substr(0, equals)));
    std::transform(name.begin(), name.end(), name.begin(), [](char c) {
      return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    });
    if (name != "wait" || equals == std::string_view::npos) {
      continue;
    }
    std::string_view value = trim(preference.substr(equals + 1));
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"') {
      value = value.substr(1, value.size() - 2);
    }
    std::int64_t seconds = 0;
    const auto read = std::from_chars(value.data(), value.data() + value.size(), seconds);
    if (value.empty() || read.ptr != value.data() + value.size() || seconds < 0) {
      return {};
    }
    // A number too long for 64 bits is above the limit too.
    return static_cast<int>(read.ec == std::errc::result_out_of_range
                                ? limits::kWaitSeconds
                                : std::min(seconds, limits::kWaitSeconds));
  }
  return {};
}

Parsed<TilesQuery> parse_tiles_query(QueryParams query) {
  TilesQuery out;
  Faults faults;
  each_parameter(
      query, {}, faults,
      [&](const std::string& name, const std::string& value, const std::string& pointer) {
        if (name != "after") {
          return false;
        }
        out.after = static_cast<std::uint32_t>(
            query_integer(value, {0, kRevisionMax}, pointer, faults).value_or(0));
        return true;
      });
  return checked(out, faults);
}

Parsed<EventsQuery> parse_events_query(QueryParams query) {
  EventsQuery out;
  Faults faults;
  each_parameter(
      query, {}, faults,
      [&](const std::string& name, const std::string& value, const std::string& pointer) {
        if (name == "last_event_id") {
          return true;  // Stands for the header; whoever reads that looks at it.
        }
        if (name != "jobs") {
          return false;
        }
        for (std::size_t begin = 0; begin <= value.size();) {
          const std::size_t end = std::min(value.find(',', begin), value.size());
          const std::string id = value.substr(begin, end - begin);
          begin = end + 1;
          if (!is_uuid(id)) {
            faults.add(pointer, shown(Json(id)) + " is not a job id (UUID)");
          } else if (std::find(out.jobs.begin(), out.jobs.end(), id) == out.jobs.end()) {
            out.jobs.push_back(id);
          }
        }
        return true;
      });
  const auto most = static_cast<std::size_t>(limits::kWatchedJobs);
  if (faults.empty() && (out.jobs.empty() || out.jobs.size() > most)) {
    faults.add("/jobs", out.jobs.empty() ? std::string("is required")
                                         : "names " + std::to_string(out.jobs.size()) +
                                               " jobs; at most " + std::to_string(most) +
                                               " are allowed");
  }
  return checked(std::move(out), faults);
}

Parsed<ImageQuery> parse_image_query(QueryParams query, std::span<const std::string> tone_maps) {
  ImageQuery out;
  RectParts rect;
  Faults faults;
  each_parameter(
      query, {}, faults,
      [&](const std::string& name, const std::string& value, const std::string& pointer) {
        if (name == "layer") {
          read_layer(value, out, pointer, faults);
        } else if (name == "exposure") {
          const auto stops = static_cast<double>(limits::kExposureStops);
          out.exposure_stops = static_cast<float>(
              read_number(number_from_text(value), {-stops, stops}, pointer, faults).value_or(0));
        } else if (name == "tonemap") {
          const std::vector<std::string_view> names(tone_maps.begin(), tone_maps.end());
          if (std::find(names.begin(), names.end(), value) == names.end()) {
            faults.add(pointer, not_available(Json(value), names));
          }
          out.tone_map = value;
        } else if (name == "range") {
          read_range(value, out, pointer, faults);
        } else if (name == "revision") {
          if (const auto n = query_integer(value, {0, kRevisionMax}, pointer, faults)) {
            out.revision = static_cast<std::uint32_t>(*n);
          }
        } else if (name == "stream") {
          out.stream = value == "1" || value == "true";
          if (!out.stream && value != "0" && value != "false") {
            faults.add(pointer, shown(Json(value)) + " is not 0, 1, false or true");
          }
        } else if (name == "max_size") {
          const Range range = {1, static_cast<double>(limits::kFilmSide)};
          if (const auto n = query_integer(value, range, pointer, faults)) {
            out.max_size = static_cast<int>(*n);
          }
        } else {
          return rect.take(name, value, pointer, faults);
        }
        return true;
      });
  out.rect = rect.rect(faults);
  return checked(out, faults);
}

Parsed<std::monostate> parse_no_query(QueryParams query) {
  Faults faults;
  each_parameter(query, {}, faults,
                 [](const std::string&, const std::string&, const std::string&) { return false; });
  return checked(std::monostate{}, faults);
}

bool is_uuid(std::string_view text) {
  constexpr std::size_t kLength = 36;
  if (text.size() != kLength) {
    return false;
  }
  for (std::size_t i = 0; i < kLength; ++i) {
    const bool is_dash = i == 8 || i == 13 || i == 18 || i == 23;
    if (is_dash ? text[i] != '-' : !is_hex(text[i])) {
      return false;
    }
  }
  return true;
}

bool is_sha256(std::string_view text) {
  constexpr std::size_t kLength = 64;
  return text.size() == kLength && std::all_of(text.begin(), text.end(), [](char c) {
           return is_hex(c) && !(c >= 'A' && c <= 'F');
         });
}

}  // namespace api
