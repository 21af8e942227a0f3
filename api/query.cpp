#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "api/errors.h"
#include "api/faults.h"
#include "api/limits.h"
#include "api/queries.h"
#include "api/query_rows.h"
#include "api/requests.h"
#include "api/schemas.h"
#include "api/server_view.h"
#include "api/tenant_view.h"
#include "api/values.h"
#include "core/settings/registry.h"

namespace api {
namespace {

Json list_schema(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

// Lists of jobs and scenes.

void read_states(const std::string& text, ListQuery& out, const std::string& pointer,
                 Faults& faults) {
  each_part(text, [&](const std::string& name) {
    if (const auto state = job_state_from_text(name)) {
      out.states.push_back(*state);
    } else {
      faults.add(pointer, shown(Json(name)) +
                              " is not a state; states: queued, loading, rendering, paused, "
                              "finished, failed, cancelled");
    }
  });
}

Json states_schema(const ListQuery& /*defaults*/) {
  Json names = Json::array();
  for (int i = 0; i <= static_cast<int>(JobState::kCancelled); ++i) {
    names.push_back(to_text(static_cast<JobState>(i)));
  }
  return list_schema({{"type", "string"}, {"enum", std::move(names)}});
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

constexpr std::string_view kCursorPattern = "^[A-Za-z0-9_-]{1,256}$";

template <typename S>
void read_cursor(const std::string& text, S& out, const std::string& pointer, Faults& faults) {
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

constexpr std::array kJobClasses = {
    core::NamedValue<ListQuery::Class>{"normal", ListQuery::Class::kNormal, "Pictures to keep."},
    core::NamedValue<ListQuery::Class>{"preview", ListQuery::Class::kPreview,
                                       "Previews, kept in memory."},
    core::NamedValue<ListQuery::Class>{"all", ListQuery::Class::kAll, "Both."},
};
std::span<const core::NamedValue<ListQuery::Class>> job_classes() { return kJobClasses; }

Json cursor_schema() { return {{"type", "string"}, {"pattern", kCursorPattern}}; }

/// The rows of a page.
template <typename S>
constexpr auto page_rows() {
  return std::tuple{
      ParameterField<S>{"cursor", "`next` of the page before.", &read_cursor<S>,
                        [](const S&) { return cursor_schema(); }},
      number(
          "limit", [](auto& s) -> auto& { return s.limit; }, {1, limits::kPageSize},
          "Items of a page."),
  };
}

const auto& scene_list_table() {
  static constexpr auto kTable = page_rows<ListQuery>();
  return kTable;
}

const auto& job_list_table() {
  static constexpr auto kTable = std::tuple_cat(
      std::tuple{
          ParameterField<ListQuery>{
              "state", "Only jobs in one of these states; may be repeated, or hold commas.",
              &read_states, &states_schema, true},
          ParameterField<ListQuery>{
              "label", "Only jobs with this label, `key=value` or `key`; may be repeated.",
              &read_label, [](const ListQuery&) { return list_schema(text_schema()); }, true},
          text(
              "name", [](auto& s) -> auto& { return s.name; }, {1, limits::kNameCharacters},
              "Only jobs whose name contains this; a job without a name goes by its scene. Case "
              "is ignored for a to z."),
          choice(
              "class", [](auto& s) -> auto& { return s.job_class; }, &job_classes,
              "Only jobs of this class: previews are left out unless they are asked for."),
      },
      page_rows<ListQuery>());
  return kTable;
}

constexpr std::array<std::string_view, 3> kDeliveryStates = {"pending", "delivered", "failed"};

void read_delivery_job(const std::string& text, DeliveryListQuery& out, const std::string& pointer,
                       Faults& faults) {
  if (!is_uuid(text)) {
    faults.add(pointer, shown(Json(text)) + " is not a job id (UUID)");
  }
  out.job = text;
}

void read_delivery_state(const std::string& text, DeliveryListQuery& out,
                         const std::string& pointer, Faults& faults) {
  if (std::find(kDeliveryStates.begin(), kDeliveryStates.end(), text) == kDeliveryStates.end()) {
    faults.add(pointer, shown(Json(text)) + " is none of pending, delivered, failed");
  }
  out.state = text;
}

const auto& delivery_list_table() {
  static constexpr auto kTable = std::tuple_cat(
      std::tuple{
          ParameterField<DeliveryListQuery>{"job", "Only calls of this job.", &read_delivery_job,
                                            [](const DeliveryListQuery&) {
                                              return Json{{"type", "string"}, {"format", "uuid"}};
                                            }},
          ParameterField<DeliveryListQuery>{
              "state", "Only calls in this state.", &read_delivery_state,
              [](const DeliveryListQuery&) {
                return Json{{"type", "string"}, {"enum", kDeliveryStates}};
              }},
      },
      page_rows<DeliveryListQuery>());
  return kTable;
}

// Uploads and submissions.

const auto& scene_upload_table() {
  static constexpr auto kTable = std::tuple{
      text(
          "name", [](auto& s) -> auto& { return s.name; }, {1, limits::kNameCharacters},
          "A name for people, such as that of the file; it replaces the name inside the file. The "
          "id depends on the content alone: the name of a tenant's first upload stays."),
  };
  return kTable;
}

const auto& submit_table() {
  static constexpr auto kTable = std::tuple{
      flag(
          "dry_run", [](auto& s) -> auto& { return s.dry_run; },
          "1: only validate the job and estimate its cost (200)."),
      ParameterField<SubmitQuery>{
          "from",
          "`image`: the body is a PNG or EXR picture that a Tessera server made; its job is "
          "submitted again and gives the same film.",
          [](const std::string& value, SubmitQuery& out, const std::string& pointer,
             Faults& faults) {
            out.from_image = value == "image";
            if (!out.from_image) {
              faults.add(pointer, shown(Json(value)) + " is not 'image'");
            }
          },
          [](const SubmitQuery&) {
            return Json{{"type", "string"}, {"enum", {"image"}}};
          }},
  };
  return kTable;
}

const auto& wait_table() {
  static constexpr auto kTable = std::tuple{
      number(
          "wait", [](auto& s) -> auto& { return s.wait_seconds; }, {0, limits::kWaitSeconds},
          "Answer at a final state (with If-None-Match: at any change), or after this many "
          "seconds."),
  };
  return kTable;
}

// Pictures.

/// x, y, width and height come together; tone_maps are the names that are allowed.
struct ImageReading {
  ImageQuery query;
  std::array<std::optional<int>, 4> rect;
  std::vector<std::string> tone_maps;
};
constexpr std::array<std::string_view, 4> kRectNames = {"x", "y", "width", "height"};

std::optional<core::PixelRect> rect_of(const ImageReading& reading, Faults& faults) {
  const auto& parts = reading.rect;
  const auto is_given = [](const auto& part) { return part.has_value(); };
  if (std::none_of(parts.begin(), parts.end(), is_given) || !faults.empty()) {
    return {};
  }
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (!parts[i]) {
      faults.add("/" + std::string(kRectNames[i]),
                 "is required; x, y, width and height come together");
    }
  }
  if (!faults.empty()) {
    return {};
  }
  return core::PixelRect{*parts[0], *parts[1], *parts[2], *parts[3]};
}

template <std::size_t kPart>
constexpr auto rect_row(std::string_view doc) {
  constexpr Range kRange =
      kPart < 2 ? Range{0, limits::kFilmSide - 1} : Range{1, limits::kFilmSide};
  return number(
      kRectNames[kPart], [](auto& s) -> auto& { return s.rect[kPart]; }, kRange, doc);
}

void read_tone_map(const std::string& value, ImageReading& out, const std::string& pointer,
                   Faults& faults) {
  const std::vector<std::string_view> names(out.tone_maps.begin(), out.tone_maps.end());
  if (std::find(names.begin(), names.end(), value) == names.end()) {
    faults.add(pointer, not_available(Json(value), names));
  }
  out.query.tone_map = value;
}

Json tone_map_schema(const ImageReading& defaults) {
  Json schema = text_schema();
  schema["default"] = defaults.query.tone_map;
  if (!defaults.tone_maps.empty()) {
    schema["enum"] = defaults.tone_maps;
  }
  return schema;
}

// "auto", or two numbers with a comma between them.
void read_range(const std::string& value, ImageReading& out, const std::string& pointer,
                Faults& faults) {
  if (value == "auto") {
    out.query.range = ImageRange{};
    return;
  }
  const auto comma = value.find(',');
  if (comma == std::string::npos) {
    faults.add(pointer,
               shown(Json(value)) + " is neither auto nor two numbers with a comma between");
    return;
  }
  constexpr auto kMost = static_cast<double>(std::numeric_limits<float>::max());
  const auto low =
      read_number(number_in_query(value.substr(0, comma)), {-kMost, kMost}, pointer, faults);
  const auto high =
      read_number(number_in_query(value.substr(comma + 1)), {-kMost, kMost}, pointer, faults);
  if (!low || !high) {
    return;
  }
  const std::array<float, 2> ends = {static_cast<float>(*low), static_cast<float>(*high)};
  if (!(ends[0] < ends[1])) {
    faults.add(pointer, "the first number must be below the second");
    return;
  }
  out.query.range = ImageRange{ends};
}

void read_background(const std::string& value, ImageReading& out, const std::string& pointer,
                     Faults& faults) {
  out.query.background = read_color(value, pointer, faults);
}

Json background_schema(const ImageReading& /*defaults*/) {
  Json schema = text_schema();
  schema["pattern"] = "^[0-9A-Fa-f]{6}$";
  schema["example"] = "ffffff";
  return schema;
}

Json range_schema(const ImageReading& /*defaults*/) {
  Json schema = text_schema();
  schema["example"] = "auto";
  return schema;
}

constexpr std::array kDenoiseShows = {
    core::NamedValue<DenoiseShow>{"off", DenoiseShow::kOff, "The plain picture."},
    core::NamedValue<DenoiseShow>{"mixed", DenoiseShow::kMixed,
                                  "Denoised, mixed with the plain one where that is better."},
    core::NamedValue<DenoiseShow>{"full", DenoiseShow::kFull, "The denoiser's own."},
};
std::span<const core::NamedValue<DenoiseShow>> denoise_shows() { return kDenoiseShows; }

const auto& image_table() {
  static constexpr auto kTable = std::tuple{
      choice(
          "layer", [](auto& s) -> auto& { return s.query.layer; }, &core::layers,
          "Beauty when absent (EXR: all layers)."),
      choice(
          "denoise", [](auto& s) -> auto& { return s.query.denoise; }, &denoise_shows,
          "off: the plain picture. mixed: the denoised one, with the plain one where that is "
          "better; it converges to the plain one. full: the denoiser's own, which may stay biased. "
          "Of beauty and the layers of denoised pictures; those show mixed when absent. "
          "X-Tessera-Error tells how wrong it is. While the job renders, a picture may be some "
          "revisions old: see X-Tessera-Revision."),
      number(
          "exposure", [](auto& s) -> auto& { return s.query.exposure_stops; },
          {-limits::kExposureStops, limits::kExposureStops},
          "Stops; display formats only. Not for exr and hdr, which are linear: 422. tif stays "
          "linear too, and X-Tessera-Ignored tells."),
      ParameterField<ImageReading>{"tonemap", "Display formats only, as with exposure.",
                                   &read_tone_map, &tone_map_schema},
      ParameterField<ImageReading>{
          "background",
          "Colour behind a transparent picture, as six digits of sRGB; the picture loses its "
          "alpha. "
          "When absent, formats without alpha (jpg, hdr) have white. Not for layers of data.",
          &read_background, &background_schema},
      ParameterField<ImageReading>{
          "range",
          "LOW,HIGH: values that become black and white, or auto. Layers of data in display "
          "formats; X-Tessera-Range tells the values used.",
          &read_range, &range_schema},
      number(
          "revision", [](auto& s) -> auto& { return s.query.revision; }, {0, kRevisionMax},
          "At least this revision, else 409."),
      rect_row<0>("Left column of a part; x, y, width and height come together."),
      rect_row<1>("Top row of a part."),
      rect_row<2>("Width of a part."),
      rect_row<3>("Height of a part."),
      number(
          "max_size", [](auto& s) -> auto& { return s.query.max_size; }, {1, limits::kFilmSide},
          "Longest side of the answer; larger pictures are scaled down."),
      flag(
          "stream", [](auto& s) -> auto& { return s.query.stream; },
          "1, or Accept: multipart/x-mixed-replace: every new picture until the end, for <img>."),
      ticket_row<ImageReading>(),
  };
  return kTable;
}

/// Wrong values of a list's query are 400.
template <typename S, typename Table>
Parsed<S> parse_list_query(const Table& table, QueryParams query) {
  S out;
  Faults faults;
  read_query(table, query, out, faults);
  if (!faults.empty()) {
    return make_problem(core::ErrorCode::kBadSyntax, faults.problem().errors);
  }
  return out;
}

}  // namespace

Parsed<ListQuery> parse_job_list_query(QueryParams query) {
  return parse_list_query<ListQuery>(job_list_table(), query);
}
Parsed<ListQuery> parse_scene_list_query(QueryParams query) {
  return parse_list_query<ListQuery>(scene_list_table(), query);
}
Parsed<DeliveryListQuery> parse_delivery_list_query(QueryParams query) {
  return parse_list_query<DeliveryListQuery>(delivery_list_table(), query);
}
Parsed<SceneUploadQuery> parse_scene_upload_query(QueryParams query) {
  return parse_query(scene_upload_table(), query, SceneUploadQuery{});
}
Parsed<SubmitQuery> parse_submit_query(QueryParams query) {
  return parse_query(submit_table(), query, SubmitQuery{});
}
Parsed<WaitQuery> parse_wait_query(QueryParams query) {
  return parse_query(wait_table(), query, WaitQuery{});
}
Parsed<ImageQuery> parse_image_query(QueryParams query, std::span<const std::string> tone_maps) {
  ImageReading reading;
  reading.tone_maps.assign(tone_maps.begin(), tone_maps.end());
  Faults faults;
  read_query(image_table(), query, reading, faults);
  reading.query.rect = rect_of(reading, faults);
  if (!faults.empty()) {
    return faults.problem();
  }
  return reading.query;
}
Parsed<std::monostate> parse_no_query(QueryParams query) {
  return parse_query(std::tuple{}, query, std::monostate{});
}

Json job_list_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(job_list_table(), ListQuery{});
}
Json scene_list_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(scene_list_table(), ListQuery{});
}
Json delivery_list_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(delivery_list_table(), DeliveryListQuery{});
}
Json scene_upload_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(scene_upload_table(), SceneUploadQuery{});
}
Json submit_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(submit_table(), SubmitQuery{});
}
Json wait_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(wait_table(), WaitQuery{});
}
Json image_parameters(const Capabilities& capabilities) {
  ImageReading defaults;
  defaults.tone_maps = capabilities.tone_maps;
  return query_parameters(image_table(), defaults);
}

}  // namespace api
