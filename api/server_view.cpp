#include "api/server_view.h"

#include <array>

#include <nlohmann/json.hpp>

#include "api/lab.h"
#include "api/limits.h"
#include "core/render/registry.h"

namespace api {
namespace {

Json to_array(const std::vector<std::string>& texts) { return texts; }

/// accepts: what of the job request each entry honours.
template <typename Entries>
Json typed_list(const Entries& entries, const std::vector<std::string>& accepts) {
  Json list = Json::array();
  for (const auto& entry : entries) {
    list.push_back({{"type", entry.name},
                    {"bias", entry.bias},
                    {"summary", entry.summary},
                    {"accepts", accepts}});
  }
  return list;
}

/// Parameters that one type of a group alone has.
struct TypeParameter {
  std::string_view group, type, parameter;
};
constexpr std::array kParameters = {
    TypeParameter{"mis", "power", "exponent"},
    TypeParameter{"roulette", "threshold", "delta"},
    TypeParameter{"splitting", "fixed", "count"},
};

/// A patch of one string at estimator/`path`..., from the innermost member outwards.
OptionRow option(const std::vector<std::string>& path, std::string_view value,
                 std::string_view bias, std::string_view summary) {
  OptionRow row;
  Json patch = value;
  for (auto key = path.rbegin(); key != path.rend(); ++key) {
    Json outer = Json::object();
    outer[*key] = std::move(patch);
    patch = std::move(outer);
  }
  // A parameter of another type is refused; null takes it out of a request that has one.
  for (const auto& [group, type, parameter] : kParameters) {
    if (path.size() > 2 && path[1] == group && value != type) {
      patch[path[0]][path[1]][std::string(parameter)] = nullptr;
    }
  }
  for (const std::string& key : path) {
    if (key != "type") {
      row.name += key + ".";
    }
  }
  row.name += value;
  row.bias = bias;
  row.summary = summary;
  row.patch = dump(patch);
  return row;
}

Json limits_json(const std::vector<ConfiguredLimit>& configured) {
  Json limits = Json::object();
  for (const LimitRow& row : limit_table()) {
    limits[std::string(row.name)] = row.value;
  }
  for (const ConfiguredLimit& limit : configured) {
    limits[limit.name] = limit.value;
  }
  return limits;
}

Json build_part(const ServerView& server) {
  return {{"id", server.build.id},
          {"commit", server.build.commit},
          {"compiler", server.build.compiler},
          {"isa", server.build.isa},
          {"embree", server.build.embree}};
}

}  // namespace

std::vector<std::string> accepted_options(std::string_view /*integrator*/) {
  return {"/integrator/max_depth", "/estimator/strategy",  "/estimator/mis",
          "/estimator/roulette",   "/estimator/splitting", "/estimator/control_variate", "/estimator/expected_values",
          "/sampler/type",         "/sampler/replicates",  "/light_sampler",
          "/adaptive"};
}

std::vector<OptionRow> estimation_options() {
  std::vector<OptionRow> options;
  for (const auto& entry : core::strategies()) {
    options.push_back(option({"estimator", "strategy"}, entry.name, entry.bias, entry.summary));
  }
  for (const auto& entry : core::mis_types()) {
    options.push_back(option({"estimator", "mis", "type"}, entry.name, entry.bias, entry.summary));
  }
  for (const auto& entry : core::roulette_types()) {
    options.push_back(
        option({"estimator", "roulette", "type"}, entry.name, entry.bias, entry.summary));
  }
  for (const auto& entry : core::splitting_types()) {
    options.push_back(
        option({"estimator", "splitting", "type"}, entry.name, entry.bias, entry.summary));
  }
  for (const auto& entry : core::control_variate_types()) {
    options.push_back(
        option({"estimator", "control_variate", "type"}, entry.name, entry.bias, entry.summary));
  }
  for (const auto& entry : core::expected_value_types()) {
    OptionRow row = option({"estimator", "expected_values"}, entry.name, entry.bias, entry.summary);
    row.patch = dump({{"estimator", {{"expected_values", entry.value}}}});
    options.push_back(std::move(row));
  }
  for (const auto& entry : core::granularities()) {
    OptionRow row = option({"adaptive", "granularity"}, entry.name, entry.bias, entry.summary);
    row.patch = dump({{"adaptive", {{"type", "pilot"}, {"granularity", entry.name}}}});
    options.push_back(std::move(row));
  }
  return options;
}

std::string build_json(const ServerView& server) {
  Json build = build_part(server);
  build["arithmetic"] = server.build.arithmetic;
  return dump(build);
}

std::string server_json(const ServerView& server) {
  Json body;
  body["version"] = server.version;
  body["build"] = build_part(server);
  body["limits"] = limits_json(server.limits);
  Json integrators = Json::array();
  for (const auto& entry : core::integrators()) {
    integrators.push_back({{"type", entry.name},
                           {"bias", entry.bias},
                           {"summary", entry.summary},
                           {"accepts", accepted_options(entry.name)}});
  }
  body["integrators"] = std::move(integrators);
  body["samplers"] = typed_list(core::samplers(), {"/sampler/replicates", "/sampler/first_replicate"});
  body["light_samplers"] = typed_list(core::light_samplers(), {});
  for (Json& entry : body["light_samplers"]) {
    if (entry["type"] == "ris") {
      entry["accepts"] = {"/light_sampler/candidates"};
    } else if (entry["type"] == "restir") {
      entry["accepts"] = {"/light_sampler/block", "/light_sampler/history",
                          "/light_sampler/candidates_per_pixel"};
    }
  }
  body["adaptive"] = typed_list(
      core::adaptive_types(), {"/adaptive/min_samples", "/adaptive/granularity", "/adaptive/dilation"});
  for (Json& row : body["adaptive"]) {
    if (row["type"] == "none") {
      row["accepts"] = Json::array();
    }
  }
  Json options = Json::array();
  for (const OptionRow& row : estimation_options()) {
    options.push_back({{"name", row.name},
                       {"bias", row.bias},
                       {"summary", row.summary},
                       {"patch", Json::parse(row.patch)}});
  }
  body["options"] = std::move(options);
  Json layers = Json::array();
  for (const core::LayerEntry& layer : core::layers()) {
    layers.push_back(layer.name);
  }
  body["layers"] = std::move(layers);
  Json formats = Json::array();
  for (const FormatView& format : server.capabilities.image_formats) {
    formats.push_back(format.extension);
  }
  body["image_formats"] = std::move(formats);
  body["tone_maps"] = to_array(server.capabilities.tone_maps);
  Json filters = Json::array();
  for (const auto& filter : core::filters()) {
    filters.push_back(filter.name);
  }
  body["filters"] = std::move(filters);
  Json scenes = Json::array();
  for (const NamedSummary& scene : server.capabilities.scenes) {
    scenes.push_back({{"name", scene.name}, {"summary", scene.summary}});
  }
  body["scenes"] = std::move(scenes);
  body["experiments"] = experiments_json();
  body["extensions"] = to_array(server.capabilities.extensions);
  return dump(body);
}

}  // namespace api
