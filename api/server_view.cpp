#include "api/server_view.h"

#include <array>

#include <nlohmann/json.hpp>

#include "api/job_spec.h"
#include "api/lab.h"
#include "api/limits.h"
#include "api/views.h"
#include "core/settings/registry.h"

namespace api {
namespace {

/// Entries of a registry; accepts(name) says which pointers an entry honours.
template <typename Entries, typename Accepts>
Json print_types(const Entries& entries, const Accepts& accepts) {
  Json list = Json::array();
  for (const auto& entry : entries) {
    list.push_back(
        type_info_view().print({entry.name, entry.bias, entry.summary, accepts(entry.name)}));
  }
  return list;
}

template <typename Entries>
Json names_of(const Entries& entries) {
  Json list = Json::array();
  for (const auto& entry : entries) {
    list.push_back(entry.name);
  }
  return list;
}

using Pointers = std::vector<std::string>;

Pointers sampler_options(std::string_view /*type*/) {
  return {"/sampler/replicates", "/sampler/first_replicate"};
}

Pointers light_sampler_options(std::string_view type) {
  if (type == "ris") {
    return {"/light_sampler/candidates"};
  }
  if (type == "restir") {
    return {"/light_sampler/block", "/light_sampler/history",
            "/light_sampler/candidates_per_pixel"};
  }
  return {};
}

Pointers adaptive_options(std::string_view type) {
  return type == "none"
             ? Pointers()
             : Pointers{"/adaptive/min_samples", "/adaptive/granularity", "/adaptive/dilation"};
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

Json limits_json(const ServerView& server) {
  Json limits = Json::object();
  for (const LimitRow& row : limit_table()) {
    limits[std::string(row.name)] = row.value;
  }
  for (const ConfiguredLimit& limit : server.limits) {
    limits[limit.name] = limit.value;
  }
  return limits;
}

/// The members of a job that does not name them; `scene` is always named.
Json defaults_json() {
  Json defaults = to_json(parse_job(R"({"scene":"x"})")->spec);
  defaults.erase("scene");
  return defaults;
}

const View<BuildView>& build_view() {
  static const View<BuildView> kView = {
      "",
      "What the bits of a film depend on besides the job.",
      {{"id", shape::text(), [](const BuildView& b) -> Json { return b.id; }},
       {"commit", shape::text(), [](const BuildView& b) -> Json { return b.commit; }},
       {"compiler", shape::text(), [](const BuildView& b) -> Json { return b.compiler; }},
       {"isa", shape::text("Instruction set that rays are traced with."),
        [](const BuildView& b) -> Json { return b.isa; }},
       {"embree", shape::text(), [](const BuildView& b) -> Json { return b.embree; }},
       {"waves", shape::flag("Paths of default options go eight side by side."),
        [](const BuildView& b) -> Json { return b.waves; }}}};
  return kView;
}

const View<NamedSummary>& builtin_scene_view() {
  static const View<NamedSummary> kView = {
      "",
      "",
      {{"name", shape::text(), [](const NamedSummary& s) -> Json { return s.name; }},
       {"summary", shape::text(), [](const NamedSummary& s) -> Json { return s.summary; }}}};
  return kView;
}

}  // namespace

std::vector<std::string> accepted_options(std::string_view integrator) {
  const core::IntegratorEntry* row = core::find_integrator(integrator);
  return row != nullptr ? std::vector<std::string>(row->accepts.begin(), row->accepts.end())
                        : std::vector<std::string>();
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
  Json build = build_view().print(server.build);
  build["arithmetic"] = server.build.arithmetic;
  return dump(build);
}

const View<TypeView>& type_info_view() {
  static const View<TypeView> kView = {
      "TypeInfo",
      "A name that requests may use.",
      {{"type", shape::text("Name in requests."), [](const TypeView& t) -> Json { return t.type; }},
       {"bias", shape::bias(), [](const TypeView& t) -> Json { return t.bias; }},
       {"summary", shape::text(), [](const TypeView& t) -> Json { return t.summary; }},
       {"accepts", shape::texts("JSON pointers of the job request that it honours."),
        [](const TypeView& t) -> Json { return t.accepts; }}}};
  return kView;
}

const View<core::IntegratorEntry>& integrator_view() {
  using Entry = core::IntegratorEntry;
  static const View<Entry> kView = {
      "IntegratorInfo",
      "An algorithm that follows light.",
      {{"type", shape::text("Name in requests."), [](const Entry& e) -> Json { return e.name; }},
       {"bias", shape::bias(), [](const Entry& e) -> Json { return e.bias; }},
       {"error",
        shape::one_of({"valid", "from-chains", "none"},
                      "What the halves of its pictures tell about the error."),
        [](const Entry& e) -> Json { return core::to_string(e.error); }},
       {"summary", shape::text(), [](const Entry& e) -> Json { return e.summary; }},
       {"accepts", shape::texts("JSON pointers of the job request that it honours."),
        [](const Entry& e) -> Json { return accepted_options(e.name); }}}};
  return kView;
}

const View<OptionRow>& option_view() {
  static const View<OptionRow> kView = {
      "EstimationOption",
      "A switch of the estimation.",
      {{"name", shape::text(), [](const OptionRow& o) -> Json { return o.name; }},
       {"bias", shape::bias(), [](const OptionRow& o) -> Json { return o.bias; }},
       {"summary", shape::text(), [](const OptionRow& o) -> Json { return o.summary; }},
       {"patch", shape::object("Merge patch (RFC 7396) of the job request that turns it on."),
        [](const OptionRow& o) { return Json::parse(o.patch); }}}};
  return kView;
}

const View<ServerView>& server_view() {
  using Server = ServerView;
  static const Json kTypes = shape::list(type_info_view().shape());
  static const View<Server> kView = {
      "Server",
      "What this server can do.",
      {{"version", shape::text(), [](const Server& s) -> Json { return s.version; }},
       {"build", build_view().shape(), [](const Server& s) { return build_view().print(s.build); }},
       {"limits", shape::map(shape::integer(), "Every maximum by name."), &limits_json},
       {"defaults", shape::reference("JobDefaults"), [](const Server&) { return defaults_json(); }},
       {"integrators", shape::list(integrator_view().shape()),
        [](const Server&) { return print_list(integrator_view(), core::integrators()); }},
       {"samplers", kTypes,
        [](const Server&) { return print_types(core::samplers(), &sampler_options); }},
       {"light_samplers", kTypes,
        [](const Server&) { return print_types(core::light_samplers(), &light_sampler_options); }},
       {"adaptive", kTypes,
        [](const Server&) { return print_types(core::adaptive_types(), &adaptive_options); }},
       {"options", shape::list(option_view().shape(), "Every other switch of the estimation."),
        [](const Server&) { return print_list(option_view(), estimation_options()); }},
       {"layers", shape::texts(), [](const Server&) { return names_of(core::layers()); }},
       {"image_formats", shape::texts("Extensions."),
        [](const Server& s) {
          Json formats = Json::array();
          for (const FormatView& format : s.capabilities.image_formats) {
            formats.push_back(format.extension);
          }
          return formats;
        }},
       {"tone_maps", shape::texts(),
        [](const Server& s) -> Json { return s.capabilities.tone_maps; }},
       {"filters", shape::texts(), [](const Server&) { return names_of(core::filters()); }},
       {"scenes", shape::list(builtin_scene_view().shape(), "Built-in scenes."),
        [](const Server& s) { return print_list(builtin_scene_view(), s.capabilities.scenes); }},
       {"experiments", shape::list(experiment_view().shape(), "Of the laboratory."),
        [](const Server&) { return experiments_json(); }},
       {"extensions", shape::texts("Of glTF."),
        [](const Server& s) -> Json { return s.capabilities.extensions; }}}};
  return kView;
}

std::string server_json(const ServerView& server) { return dump(server_view().print(server)); }

}  // namespace api
