#include "api/answers/server_view.h"

#include <span>
#include <type_traits>

#include <nlohmann/json.hpp>

#include "api/answers/views.h"
#include "api/job/job_spec.h"
#include "api/json/limits.h"
#include "api/lab.h"
#include "core/integrators/registry.h"
#include "core/layers/layer_rows.h"
#include "core/settings/choices.h"
#include "core/settings/light_shares.h"

namespace api {
namespace {

/// A name from a registry that requests may use.
struct TypeView {
  std::string_view type;
  std::string_view bias;
  std::string_view summary;
  std::vector<std::string> accepts;  ///< JSON pointers of the job request that it supports
};

std::vector<std::string> texts_of(const core::Options& options) {
  return {options.begin(), options.end()};
}

const View<TypeView>& type_info_view() {
  static const View<TypeView> kView = {
      "TypeInfo",
      "A name that requests can use.",
      {{"type", shape::text("Name in requests."), Member<&TypeView::type>::json},
       {"bias", shape::bias(), Member<&TypeView::bias>::json},
       {"summary", shape::text(), Member<&TypeView::summary>::json},
       {"accepts", shape::texts("JSON pointers of the job request that it supports."),
        Member<&TypeView::accepts>::json}}};
  return kView;
}

template <typename Value>
Json print_types(std::span<const core::NamedValue<Value>> rows) {
  Json list = Json::array();
  for (const auto& row : rows) {
    list.push_back(
        type_info_view().print({row.name, row.bias, row.summary, texts_of(row.accepts)}));
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

/// Returns the layers that are recorded by default or always, or the others.
Json layer_names(bool by_default) {
  Json names = Json::array();
  for (const core::LayerEntry& row : core::layers()) {
    const bool is_there = row.recorded == nullptr || core::FilmSettings().*row.recorded;
    if (is_there == by_default) {
      names.push_back(row.name);
    }
  }
  return names;
}

/// Returns the switches of one group. Each row's patch sets one string at `path`, and sets to null
/// the options that only other rows accept, which removes them from a request.
template <typename Value>
void add_options(std::vector<OptionRow>& options, const std::string& path, std::string_view group,
                 std::span<const core::NamedValue<Value>> rows) {
  for (const auto& row : rows) {
    Json patch = Json::object();
    for (const auto& other : rows) {
      for (const std::string_view option : other.accepts) {
        patch[Json::json_pointer(std::string(option))] = nullptr;
      }
    }
    for (const std::string_view option : row.accepts) {
      const Json::json_pointer own{std::string(option)};
      patch[own.parent_pointer()].erase(own.back());
    }
    if constexpr (std::is_same_v<Value, bool>) {
      patch[Json::json_pointer(path)] = row.value;
    } else {
      patch[Json::json_pointer(path)] = row.name;
    }
    options.push_back({std::string(group) + "." + std::string(row.name), std::string(row.bias),
                       std::string(row.summary), dump(patch)});
  }
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

/// Returns the default members of a job, without `scene`, which has no default.
Json defaults_json() {
  Json defaults = to_json(parse_job(R"({"scene":"x"})")->spec);
  defaults.erase("scene");
  return defaults;
}

std::vector<std::string_view> error_names() {
  std::vector<std::string_view> names;
  for (const auto& row : core::error_validities()) {
    names.push_back(row.name);
  }
  return names;
}

/// Returns the members of `own` that differ from those of `usual`.
Json difference(const Json& own, const Json& usual) {
  Json patch = Json::object();
  for (const auto& member : own.items()) {
    if (!usual.contains(member.key())) {  // an option that `usual` lacks
      patch[member.key()] = member.value();
      continue;
    }
    const Json& other = usual.at(member.key());
    if (member.value() == other) {
      continue;
    }
    patch[member.key()] = other.is_object() ? difference(member.value(), other) : member.value();
  }
  return patch;
}

/// Returns the defaults of an integrator's jobs that differ from those of other jobs.
Json own_defaults_json(std::string_view integrator) {
  JobSpec spec;
  spec.render = core::default_settings(integrator, core::kJobTerms);
  Json own = to_json(spec);
  own["integrator"]["type"] = core::RenderSettings{}.integrator;
  return difference(own, to_json(JobSpec{}));
}

const View<BuildView>& build_view() {
  static const View<BuildView> kView = {
      "",
      "Build and machine properties on which the bits of a film depend besides the job.",
      {{"id", shape::text(), Member<&BuildView::id>::json},
       {"commit", shape::text(), Member<&BuildView::commit>::json},
       {"compiler", shape::text(), Member<&BuildView::compiler>::json},
       {"isa", shape::text("Instruction set for ray tracing."), Member<&BuildView::isa>::json},
       {"embree", shape::text(), Member<&BuildView::embree>::json},
       {"waves", shape::flag("Paths with default options are traced in groups of eight."),
        Member<&BuildView::waves>::json}}};
  return kView;
}

const View<NamedSummary>& builtin_scene_view() {
  static const View<NamedSummary> kView = {
      "",
      "",
      {{"name", shape::text(), Member<&NamedSummary::name>::json},
       {"summary", shape::text(), Member<&NamedSummary::summary>::json}}};
  return kView;
}

const View<core::IntegratorEntry>& integrator_view() {
  using Entry = core::IntegratorEntry;
  static const View<Entry> kView = {
      "IntegratorInfo",
      "An algorithm that traces light paths.",
      {{"type", shape::text("Name in requests."), Member<&Entry::name>::json},
       {"bias", shape::bias(), Member<&Entry::bias>::json},
       {"error", shape::one_of(error_names(), "How the error of its images is known."),
        [](const Entry& e) -> Json {
          return core::row_of(core::error_validities(), e.error).name;
        }},
       {"summary", shape::text(), Member<&Entry::summary>::json},
       {"accepts", shape::texts("JSON pointers of the job request that it supports."),
        [](const Entry& e) -> Json { return texts_of(e.accepts); }},
       {"defaults", shape::object("Merge patch (RFC 7396) of `defaults` for its jobs."),
        [](const Entry& e) { return own_defaults_json(e.name); }}}};
  return kView;
}

const View<OptionRow>& option_view() {
  static const View<OptionRow> kView = {
      "EstimationOption",
      "An estimator setting.",
      {{"name", shape::text(), Member<&OptionRow::name>::json},
       {"bias", shape::bias(), Member<&OptionRow::bias>::json},
       {"summary", shape::text(), Member<&OptionRow::summary>::json},
       {"patch", shape::object("Merge patch (RFC 7396) of the job request that selects it."),
        [](const OptionRow& o) { return Json::parse(o.patch); }}}};
  return kView;
}

const View<ServerView>& server_view() {
  using Server = ServerView;
  static const Json kTypes = shape::list(type_info_view().shape());
  static const View<Server> kView = {
      "Server",
      "Server capabilities.",
      {{"version", shape::text(), Member<&Server::version>::json},
       {"build", build_view().shape(), [](const Server& s) { return build_view().print(s.build); }},
       {"limits", shape::map(shape::integer(), "Every limit by name."), &limits_json},
       {"defaults", shape::reference("JobDefaults"), [](const Server&) { return defaults_json(); }},
       {"integrators", shape::list(integrator_view().shape()),
        [](const Server&) { return print_list(integrator_view(), core::integrators()); }},
       {"samplers", kTypes, [](const Server&) { return print_types(core::samplers()); }},
       {"light_samplers", kTypes,
        [](const Server&) { return print_types(core::light_samplers()); }},
       {"adaptive", kTypes, [](const Server&) { return print_types(core::adaptive_types()); }},
       {"options", shape::list(option_view().shape(), "Every other estimator setting."),
        [](const Server&) { return print_list(option_view(), estimation_options()); }},
       {"layers", shape::texts("Layers that are recorded by default."),
        [](const Server&) { return layer_names(true); }},
       {"optional_layers",
        shape::texts("Layers that are recorded only if `film.layers` lists them."),
        [](const Server&) { return layer_names(false); }},
       {"layer_patterns", shape::texts("Patterns of layers with a number or name."),
        [](const Server&) { return names_of(core::layer_patterns()); }},
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
       {"experiments", shape::list(experiment_view().shape(), "Experiments of the laboratory."),
        [](const Server&) { return experiments_json(); }},
       {"extensions", shape::texts("Supported glTF extensions."),
        [](const Server& s) -> Json { return s.capabilities.extensions; }}}};
  return kView;
}

const View<DrainView>& drain_view() {
  static const View<DrainView> kView = {
      "Drain",
      "Whether the server accepts new jobs, and its remaining work.",
      {{"draining", shape::flag("New jobs are refused with 503, and queued jobs do not start."),
        Member<&DrainView::draining>::json},
       {"running", shape::count("Jobs that are loading, rendering or ending; they continue."),
        Member<&DrainView::running>::json},
       {"queued", shape::count("Queued jobs."), Member<&DrainView::queued>::json}}};
  return kView;
}

}  // namespace

std::vector<OptionRow> estimation_options() {
  std::vector<OptionRow> all;
  add_options(all, "/estimator/strategy", "estimator.strategy", core::strategies());
  add_options(all, "/estimator/mis/type", "estimator.mis", core::mis_types());
  add_options(all, "/estimator/roulette/type", "estimator.roulette", core::roulette_types());
  add_options(all, "/estimator/splitting/type", "estimator.splitting", core::splitting_types());
  add_options(all, "/estimator/control_variate/type", "estimator.control_variate",
              core::control_variate_types());
  add_options(all, "/estimator/expected_values", "estimator.expected_values",
              core::expected_value_types());
  add_options(all, "/spectral", "spectral", core::spectral_types());
  for (const auto& entry : core::granularities()) {
    all.push_back({"adaptive.granularity." + std::string(entry.name), std::string(entry.bias),
                   std::string(entry.summary),
                   dump({{"adaptive", {{"type", "pilot"}, {"granularity", entry.name}}}})});
  }
  return all;
}

std::string build_json(const ServerView& server) {
  Json build = build_view().print(server.build);
  build["arithmetic"] = server.build.arithmetic;
  return dump(build);
}

std::string drain_json(const DrainView& drain) { return dump(drain_view().print(drain)); }

std::string server_json(const ServerView& server) { return dump(server_view().print(server)); }

void add_server_schemas(Json& components) {
  type_info_view().add_to(components);
  integrator_view().add_to(components);
  option_view().add_to(components);
  experiment_view().add_to(components);
  server_view().add_to(components);
  drain_view().add_to(components);
}

}  // namespace api
