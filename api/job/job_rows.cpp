#include "api/job/job_rows.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <vector>

#include "api/json/fields.h"
#include "api/json/limits.h"
#include "api/requests.h"
#include "core/base/text.h"
#include "core/layers/layer_rows.h"
#include "core/settings/light_shares.h"

namespace api {
namespace {

const auto& crop_table() {
  static constexpr auto kTable = std::tuple{
      number("x", &core::PixelRect::x, {0, limits::kFilmSide - 1},
             "Left column, in pixels of the full film."),
      number("y", &core::PixelRect::y, {0, limits::kFilmSide - 1},
             "Top row, in pixels of the full film."),
      number("width", &core::PixelRect::width, {1, limits::kFilmSide}, "Pixels."),
      number("height", &core::PixelRect::height, {1, limits::kFilmSide}, "Pixels."),
  };
  return kTable;
}

const auto& medium_table() {
  // At the upper end, a metre of the medium is opaque.
  constexpr Range kCoefficient = {0, 1e6};
  constexpr double kMostForward = 0.999;
  static constexpr auto kTable = std::tuple{
      choice("type", &core::FogSettings::type, &core::fog_types, "Kind of medium."),
      triple("scattering", &core::FogSettings::scattering, kCoefficient,
             "Coefficient in 1/m, linear RGB."),
      triple("absorption", &core::FogSettings::absorption, kCoefficient,
             "Coefficient in 1/m, linear RGB."),
      number("g", &core::FogSettings::g, {-kMostForward, kMostForward},
             "Mean cosine of the scattering angle (Henyey and Greenstein): 0 is isotropic, above 0 "
             "forward."),
      number("height_falloff", &core::FogSettings::height_falloff, {0, 1e3},
             "Density is proportional to exp(-height_falloff y); the coefficients are those at y = "
             "0."),
  };
  return kTable;
}

}  // namespace

void read_labels(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  if (!expect_object(value, pointer, faults)) {
    return;
  }
  if (value.size() > static_cast<std::size_t>(limits::kLabels)) {
    faults.add(pointer, "has " + std::to_string(value.size()) + " labels; at most " +
                            std::to_string(limits::kLabels) + " are allowed");
    return;
  }
  spec.labels.clear();
  for (const auto& member : value.items()) {
    const std::string place = join_pointer(pointer, member.key());
    Faults key_faults;
    if (!read_text(Json(member.key()), {1, limits::kLabelKeyCharacters}, place, key_faults)) {
      faults.add(place, "the key " + key_faults.problem().errors.front().detail);
    } else if (auto label =
                   read_text(member.value(), {0, limits::kLabelValueCharacters}, place, faults)) {
      spec.labels[member.key()] = std::move(*label);
    }
  }
}

void print_labels(const JobSpec& spec, Json& object) {
  Json labels = Json::object();
  for (const auto& [key, label] : spec.labels) {
    labels[key] = label;
  }
  object["labels"] = std::move(labels);
}

Json labels_schema(const JobSpec& /*defaults*/) {
  Json schema = basic_schema("object", "Key-value pairs for finding jobs.");
  schema["maxProperties"] = limits::kLabels;
  schema["propertyNames"] = {{"minLength", 1}, {"maxLength", limits::kLabelKeyCharacters}};
  schema["additionalProperties"] = {{"type", "string"},
                                    {"maxLength", limits::kLabelValueCharacters}};
  schema["default"] = Json::object();
  return schema;
}

/// Returns whether it is scheme://host[:port][/...] without a user, spaces or a fragment.
bool is_web_address(std::string_view url) {
  const auto after_scheme = [&url](std::string_view scheme) {
    return url.substr(0, scheme.size()) == scheme ? url.substr(scheme.size()) : std::string_view();
  };
  std::string_view rest = after_scheme("https://");
  rest = rest.empty() ? after_scheme("http://") : rest;
  const std::string_view authority = rest.substr(0, rest.find_first_of("/?"));
  const bool plain = std::all_of(url.begin(), url.end(), [](char c) {
    return c > ' ' && c < '\x7f' && c != '#' && c != '\\' && c != '"';
  });
  return plain && !authority.empty() && authority.front() != ':' &&
         authority.find('@') == std::string_view::npos;
}

constexpr std::array<std::string_view, 3> kWebhookEvents = {"state", "warning", "end"};

void read_webhook_events(const Json& value, Webhook& webhook, const std::string& pointer,
                         Faults& faults) {
  if (!value.is_array() || value.empty()) {
    faults.add(pointer, "expected an array of at least one of state, warning, end");
    return;
  }
  webhook.events.clear();
  for (std::size_t i = 0; i < value.size(); ++i) {
    const bool known =
        value[i].is_string() && std::find(kWebhookEvents.begin(), kWebhookEvents.end(),
                                          value[i].get<std::string>()) != kWebhookEvents.end();
    if (!known) {
      faults.add(join_pointer(pointer, std::to_string(i)),
                 shown(value[i]) + " is not one of state, warning, end");
    }
  }
  for (const std::string_view name : kWebhookEvents) {
    if (std::find(value.begin(), value.end(), Json(name)) != value.end()) {
      webhook.events.emplace_back(name);
    }
  }
}

const auto& webhook_table() {
  static constexpr auto kTable = std::tuple{
      required_text("url", &Webhook::url, {1, limits::kWebhookUrlCharacters},
                    "http or https; receives a signed POST (Standard Webhooks) for each event."),
      CustomRow<Webhook>{"events", &read_webhook_events,
                         [](const Webhook& s, Json& object) { object["events"] = s.events; },
                         [](const Webhook& defaults) {
                           Json schema = basic_schema("array", "Events to send.");
                           schema["items"] = {{"type", "string"}, {"enum", kWebhookEvents}};
                           schema["minItems"] = 1;
                           schema["default"] = defaults.events;
                           return schema;
                         }},
  };
  return kTable;
}

void read_webhook(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  spec.webhook.reset();
  if (value.is_null()) {
    return;
  }
  Webhook webhook;
  read_members(webhook_table(), value, webhook, pointer, faults);
  if (!webhook.url.empty() && !is_web_address(webhook.url)) {
    faults.add(join_pointer(pointer, "url"),
               shown(Json(webhook.url)) + " is not http(s)://host[:port]/path without a user");
  }
  spec.webhook = std::move(webhook);
}

void print_webhook(const JobSpec& spec, Json& object) {
  object["webhook"] = spec.webhook ? print_members(webhook_table(), *spec.webhook) : Json(nullptr);
}

Json webhook_schema(const JobSpec& /*defaults*/) {
  Json schema = object_schema(webhook_table(), Webhook{}, "Webhook to notify.");
  schema["type"] = {"object", "null"};
  schema["default"] = nullptr;
  return schema;
}

void read_crop(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  spec.render.film.crop.reset();
  if (value.is_null() || !expect_object(value, pointer, faults)) {
    return;
  }
  core::PixelRect crop;
  for (const std::string_view member : member_names(crop_table())) {
    if (!value.contains(std::string(member))) {
      faults.add(join_pointer(pointer, member), "is required");
    }
  }
  read_members(crop_table(), value, crop, pointer, faults);
  spec.render.film.crop = crop;
}

void print_crop(const JobSpec& spec, Json& object) {
  const auto& crop = spec.render.film.crop;
  object["crop"] = crop ? print_members(crop_table(), *crop) : Json(nullptr);
}

Json crop_schema(const JobSpec& /*defaults*/) {
  Json schema = object_schema(crop_table(), core::PixelRect{},
                              "Part of the film to render; null: all of it.");
  for (auto& property : schema["properties"]) {
    property.erase("default");
  }
  schema["type"] = {"object", "null"};
  schema["required"] = member_names(crop_table());
  schema["default"] = nullptr;
  return schema;
}

void read_medium(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  spec.render.fog.reset();
  if (value.is_null() || !expect_object(value, pointer, faults)) {
    return;
  }
  core::FogSettings fog;
  read_members(medium_table(), value, fog, pointer, faults);
  spec.render.fog = fog;
}

void print_medium(const JobSpec& spec, Json& object) {
  const auto& fog = spec.render.fog;
  object["medium"] = fog ? print_members(medium_table(), *fog) : Json(nullptr);
}

Json medium_schema(const JobSpec& /*defaults*/) {
  Json schema = object_schema(medium_table(), core::FogSettings{},
                              "Participating medium (fog, smoke, haze) in the bounding sphere of "
                              "the scene, outside solids. null: none.");
  schema["type"] = {"object", "null"};
  schema["default"] = nullptr;
  return schema;
}

Json layer_schema() {
  Json names = Json::array();
  for (const core::LayerEntry& layer : core::layers()) {
    names.push_back(layer.name);
  }
  const Json shares = {{"type", "string"},
                       {"pattern",
                        "^(bounce:(0|[1-9][0-9]{0,5})-?|light:.+|irradiance|st:(0|[1-9][0-9]{0,5}),"
                        "[1-9][0-9]{0,5}(:unweighted)?)$"}};
  return {{"anyOf", {{{"type", "string"}, {"enum", std::move(names)}}, shares}}};
}

std::string unknown_layer(const Json& value) {
  std::vector<std::string_view> names;
  for (const core::LayerEntry& layer : core::layers()) {
    names.push_back(layer.name);
  }
  for (const core::LayerPattern& pattern : core::layer_patterns()) {
    names.push_back(pattern.name);
  }
  return not_available(value, names);
}

std::string share_pointer(const JobSpec& spec, std::size_t share) {
  return join_pointer("/film/layers", std::to_string(spec.share_places.at(share)));
}

void read_layers(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  if (!value.is_array()) {
    faults.add(pointer, "expected an array of layer names, got " + std::string(type_text(value)));
    return;
  }
  std::vector<std::string_view> known;
  for (const core::LayerEntry& layer : core::layers()) {
    known.push_back(layer.name);
  }
  std::vector<std::string> asked;
  spec.render.film.shares.clear();
  spec.share_places.clear();
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string place = join_pointer(pointer, std::to_string(i));
    if (!value[i].is_string()) {
      faults.add(place, "expected a string, got " + std::string(type_text(value[i])));
      continue;
    }
    const auto& name = value[i].get_ref<const std::string&>();
    auto share = core::light_share(name);
    const bool is_known = share || std::find(known.begin(), known.end(), name) != known.end();
    if (!is_known) {
      faults.add(place, unknown_layer(value[i]));
    } else if (std::find(asked.begin(), asked.end(), name) != asked.end()) {
      faults.add(place, shown(value[i]) + " appears more than once");
    } else {
      asked.push_back(name);
      if (share) {
        spec.render.film.shares.push_back(*std::move(share));
        spec.share_places.push_back(i);
      }
    }
  }
  const auto has = [&asked](std::string_view name) {
    return std::find(asked.begin(), asked.end(), name) != asked.end();
  };
  spec.layers.clear();
  for (const std::string_view name : known) {
    if (has(name)) {
      spec.layers.emplace_back(name);
    }
  }
  for (const core::LightShare& share : spec.render.film.shares) {
    spec.layers.push_back(share.layer);
  }
  if (spec.render.film.shares.size() > static_cast<std::size_t>(limits::kLightShares)) {
    faults.add(pointer, "names " + std::to_string(spec.render.film.shares.size()) +
                            " light shares; at most " + std::to_string(limits::kLightShares) +
                            " are allowed");
  }
  for (const core::LayerEntry& layer : core::layers()) {
    if (layer.recorded != nullptr) {
      spec.render.film.*layer.recorded = has(layer.name);
    }
  }
}

std::vector<std::string> recordable_layers() {
  std::vector<std::string> names;
  for (const core::LayerEntry& layer : core::layers()) {
    if (layer.recorded != nullptr) {
      names.emplace_back(layer.name);
    }
  }
  return names;
}

std::vector<std::string> default_layers() {
  std::vector<std::string> names;
  for (const core::LayerEntry& layer : core::layers()) {
    if (layer.recorded != nullptr && core::FilmSettings().*layer.recorded) {
      names.emplace_back(layer.name);
    }
  }
  return names;
}

void print_layers(const JobSpec& spec, Json& object) { object["layers"] = spec.layers; }

Json layers_schema(const JobSpec& defaults) {
  Json schema =
      basic_schema("array", "Layers to record: " + core::joined(recordable_layers(), ", ") +
                                ", light shares (bounce:N and light:NAME for path and bdpt, st:S,T "
                                "for bdpt), and irradiance. All other layers are always recorded.");
  schema["items"] = layer_schema();
  schema["uniqueItems"] = true;
  schema["default"] = defaults.layers;
  return schema;
}

void read_replicates(const Json& value, JobSpec& spec, const std::string& pointer, Faults& faults) {
  const auto count = read_integer(value, {2, limits::kReplicates}, pointer, faults);
  if (count && *count % 2 != 0) {
    faults.add(pointer, std::to_string(*count) + " is odd; replicates come in pairs");
  } else if (count) {
    spec.render.replicates = static_cast<int>(*count);
  }
}

Json replicates_schema(const JobSpec& defaults) {
  Json schema = basic_schema("integer", "Number of independent randomisations per pixel; even.");
  schema["minimum"] = 2;
  schema["maximum"] = limits::kReplicates;
  schema["multipleOf"] = 2;
  schema["default"] = defaults.render.replicates;
  return schema;
}

void read_first_replicate(const Json& value, JobSpec& spec, const std::string& pointer,
                          Faults& faults) {
  const auto first = read_integer(value, {0, limits::kFirstReplicate}, pointer, faults);
  if (first && *first % 2 != 0) {
    faults.add(pointer, std::to_string(*first) + " is odd; replicates come in pairs");
  } else if (first) {
    spec.render.first_replicate = static_cast<int>(*first);
  }
}

Json first_replicate_schema(const JobSpec& defaults) {
  Json schema = basic_schema("integer",
                             "Number of the seed's first replicate; even. Jobs with different "
                             "replicates can be merged into the film of a single job.");
  schema["minimum"] = 0;
  schema["maximum"] = limits::kFirstReplicate;
  schema["multipleOf"] = 2;
  schema["default"] = defaults.render.first_replicate;
  return schema;
}

}  // namespace api
