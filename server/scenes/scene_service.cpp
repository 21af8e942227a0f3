#include "server/scenes/scene_service.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "api/answers/job_view.h"
#include "api/json/json.h"
#include "core/image_io/image_io.h"
#include "core/image_io/radiance.h"
#include "core/lights/made_environment.h"
#include "core/scene/ground.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/scene_io/shutter.h"
#include "core/settings/choices.h"
#include "server/scenes/scene_facts.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

constexpr int kUploadsAtATime = 2;

/// For scenes whose loading was not measured: built-in ones, and those of older stores.
constexpr std::uint64_t kLoadFactor = 4;

std::string environment_key(const std::string& asset, const core::EnvironmentSettings& settings) {
  std::string key = asset;
  for (const float number : {settings.color.r, settings.color.g, settings.color.b,
                             settings.intensity, settings.rotation_degrees}) {
    key += " " + api::number_text(api::shortest_double(number));
  }
  return key;
}

std::uint64_t pixels_of(const core::Image& image) {
  return static_cast<std::uint64_t>(image.width) * static_cast<std::uint64_t>(image.height);
}

/// Texels, and a distribution over them.
std::uint64_t environment_bytes(const core::Image& image) { return pixels_of(image) * 20; }

/// Bytes per decoded pixel, its texture and its weight. Measured by tests/stress/memory --measure:
/// 28 for a Radiance file, whose pixels take 12; pixels of four floats take 4 more.
constexpr std::uint64_t kEnvironmentLoadBytes = 40;

Error unknown_scene(const std::string& id, std::string where) {
  std::string text = "no scene has the id \"" + id + "\"; built-in scenes:";
  for (const core::BuiltinScene& scene : core::builtin_scenes()) {
    text += " " + std::string(scene.name);
  }
  return Error{ErrorCode::kNotFound, std::move(text), std::move(where)};
}

Error unknown_environment(const std::string& asset) {
  return Error{ErrorCode::kInvalidArgument, "no asset has the id \"" + asset + "\"",
               "/environment/asset"};
}

}  // namespace

std::string SceneService::cache_key(const std::string& id, const core::SceneMoment& moment,
                                    const SceneStand& stand) {
  std::string key = id + "\n" +
                    (moment.time_seconds ? std::to_string(*moment.time_seconds) : "rest") + "\n" +
                    (moment.variant ? "=" + *moment.variant : "");
  if (moment.shutter_seconds > 0) {
    key += "\nopen " + api::number_text(moment.shutter_seconds);
  }
  const core::GroundSettings& ground = stand.ground;
  if (ground.type == core::GroundType::kNone) {
    return key;
  }
  key += "\n" + std::string(core::row_of(core::grounds(), ground.type).name);
  for (const float number : {ground.height_m.value_or(NAN), ground.color.r, ground.color.g,
                             ground.color.b, ground.reflection}) {
    key += " " + api::number_text(api::shortest_double(number));
  }
  if (ground.type == core::GroundType::kSweep) {
    for (const float number : {stand.view_direction.x, stand.view_direction.z}) {
      key += " " + api::number_text(api::shortest_double(number));
    }
  }
  return key;
}

SceneService::SceneService(Assets& assets, SceneTable& table, StorageQuota& quota,
                           MemoryGate& memory, SceneServiceOptions options)
    : assets_(assets),
      table_(table),
      quota_(quota),
      memory_(memory),
      options_(std::move(options)),
      scenes_(options_.cache_bytes),
      later_(options_.motion_cache_bytes),
      environments_(options_.environment_cache_bytes),
      trees_(options_.tree_cache_bytes),
      uploads_(kUploadsAtATime) {
  memory_.add_reclaimer([this] {
    return scenes_.drop_unused() || later_.drop_unused() || environments_.drop_unused() ||
           trees_.drop_unused();
  });
}

SingleFlightCache<core::Scene>::Made SceneService::held(const std::string& key,
                                                        std::shared_ptr<const core::Scene> scene) {
  const std::uint64_t bytes = scene->summary().bytes;
  auto lease = memory_.note({.shared = {{key, bytes}}}, MemoryGate::Kind::kIdle);
  return {.value = with_lease(std::move(scene), std::move(lease)), .bytes = bytes};
}

core::SharedBytes SceneService::builtin_glb(std::string_view name) {
  const core::BuiltinScene* scene = core::find_builtin_scene(name);
  if (scene == nullptr) {
    return nullptr;
  }
  {
    const core::MutexLock lock(builtin_mutex_);
    if (const auto found = builtin_.find(name); found != builtin_.end()) {
      return found->second;
    }
  }
  auto made = std::make_shared<const core::Bytes>(scene->make_glb());
  const core::MutexLock lock(builtin_mutex_);
  return builtin_.emplace(std::string(name), std::move(made)).first->second;
}

core::Result<SceneFiles> SceneService::files(const std::string& id) {
  auto row = table_.find_scene(id, Access::operators());
  if (!row) {
    return row.error();
  }
  return *row ? core::Result<SceneFiles>(std::move((*row)->files)) : unknown_scene(id, "");
}

core::Result<SceneService::Document> SceneService::document_of(const std::string& id) {
  if (auto glb = builtin_glb(id)) {
    return Document{.bytes = std::move(glb), .files = {}};
  }
  const auto row = table_.find_scene(id, Access::operators());
  if (!row) {
    return row.error();
  }
  if (!*row) {
    return unknown_scene(id, "");
  }
  Document document;
  std::map<std::string, core::SharedBytes> known;  // One file may have many names.
  for (const auto& [uri, asset] : (*row)->files) {
    core::SharedBytes& bytes = known[asset];
    if (!bytes) {
      auto read = assets_.read(asset, Access::operators());
      if (!read) {
        return read.error();
      }
      bytes = std::move(*read);
    }
    (uri.empty() ? document.bytes : document.files[uri]) = bytes;
  }
  if (!document.bytes) {
    return Error{ErrorCode::kInternal, "the stored scene has lost its document", id};
  }
  return document;
}

core::Result<SceneService::Source> SceneService::open(const std::string& id, const Memory& needed,
                                                      const LoadTerms& terms) {
  MemoryGate::Lease lease;
  if (terms.admission == LoadTerms::Admission::kNeeded) {
    auto taken = memory_.take({.bytes = needed.load_bytes, .shared = {{needed.name, needed.bytes}}},
                              "the scene");
    if (!taken) {
      return taken.error();
    }
    lease = *std::move(taken);
  }
  auto document = document_of(id);
  if (!document) {
    return document.error();
  }
  return Source{.lease = std::move(lease), .document = *std::move(document)};
}

core::Result<core::SceneDescription> SceneService::describe(const Document& document,
                                                            core::GltfOptions bounded,
                                                            const std::stop_token& stop) {
  bounded.limits.admit = [admit = std::move(bounded.limits.admit),
                          goes_on = core::until_stopped(stop)](std::uint64_t bytes) {
    const Status status = goes_on(bytes);
    return status && admit ? admit(bytes) : status;
  };
  if (memory_.bytes_max() > 0) {
    bounded.limits.decoded_bytes_max =
        std::min<std::uint64_t>(bounded.limits.decoded_bytes_max, memory_.bytes_max());
  }
  const auto resolve = [&document](std::string_view uri) -> core::SharedBytes {
    const auto found = document.files.find(std::string(uri));
    return found == document.files.end() ? nullptr : found->second;
  };
  return core::load_gltf(*document.bytes, resolve, bounded);
}

core::Result<std::shared_ptr<const core::Scene>> SceneService::build(
    const Document& document, const core::GltfOptions& options, const std::stop_token& stop,
    const SceneStand& stand) {
  auto description = describe(document, options, stop);
  if (!description) {
    return description.error();
  }
  core::add_ground(*description, stand.ground, stand.view_direction);
  return core::Scene::build(std::move(*description), options_.threads, options_.isa, stop);
}

core::Result<std::shared_ptr<const core::Scene>> SceneService::load(const std::string& id,
                                                                    const core::SceneMoment& moment,
                                                                    const LoadTerms& terms,
                                                                    const SceneStand& stand) {
  using Made = SingleFlightCache<core::Scene>::Made;
  const std::string key = cache_key(id, moment, stand);
  return scenes_.get(
      key,
      [&]() -> core::Result<Made> {
        const auto source = open(id, memory_of_scene(id, moment, stand), terms);
        if (!source) {
          return source.error();
        }
        auto scene = build(source->document, core::GltfOptions{moment}, terms.stop, stand);
        if (!scene) {
          return scene.error();
        }
        if (core::find_builtin_scene(id) != nullptr) {
          const core::MutexLock lock(builtin_mutex_);
          builtin_bytes_[id] = (*scene)->summary().bytes;
        }
        return held(key, *std::move(scene));
      },
      terms.stop);
}

core::Result<std::shared_ptr<const core::MotionTarget>> SceneService::later(
    const std::string& id, const core::SceneMoment& moment, const LoadTerms& terms) {
  using Made = SingleFlightCache<core::MotionTarget>::Made;
  const Memory needed = memory_of_later(id, moment);
  std::string key = needed.name;
  const core::Place origin = moment.origin.value();
  for (const double at : {origin.x, origin.y, origin.z}) {
    key += " " + std::to_string(at);
  }
  return later_.get(
      key,
      [&]() -> core::Result<Made> {
        const auto source = open(id, needed, terms);
        if (!source) {
          return source.error();
        }
        auto description = describe(source->document, core::GltfOptions{moment}, terms.stop);
        if (!description) {
          return description.error();
        }
        auto target = std::make_shared<const core::MotionTarget>(*std::move(description));
        const std::uint64_t bytes = target->bytes();
        auto held = memory_.note({.shared = {{needed.name, bytes}}}, MemoryGate::Kind::kIdle);
        return Made{.value = with_lease(std::move(target), std::move(held)), .bytes = bytes};
      },
      terms.stop);
}

core::Result<std::string> SceneService::description(const std::string& id, const Access& access) {
  if (core::find_builtin_scene(id) != nullptr) {
    const auto scene = load(id, core::SceneMoment());
    if (!scene) {
      return scene.error();
    }
    return api::scene_json(id, (*scene)->summary());
  }
  auto row = table_.find_scene(id, access);
  if (!row) {
    return row.error();
  }
  if (!*row) {
    return unknown_scene(id, "");
  }
  return std::move((*row)->description);
}

core::Result<core::SceneSummary> SceneService::facts(const std::string& id, const Access& access) {
  if (core::find_builtin_scene(id) != nullptr) {
    const auto scene = load(id, core::SceneMoment());
    if (!scene) {
      return scene.error();
    }
    return decode_facts(encode_facts((*scene)->summary()));
  }
  const auto row = table_.find_scene(id, access);
  if (!row) {
    return row.error();
  }
  if (!*row) {
    return unknown_scene(id, "/scene");
  }
  core::SceneSummary facts = decode_facts((*row)->facts);
  if (lacks_extremes(facts)) {
    const auto scene = load(id, core::SceneMoment());
    if (!scene) {
      return scene.error();
    }
    const std::string text = encode_facts((*scene)->summary(), load_bytes_of((*row)->facts));
    if (const Status status = table_.set_facts(id, text); !status) {
      return status.error();
    }
    facts = decode_facts(text);
  }
  return facts;
}

core::Result<std::vector<SceneRow>> SceneService::list(const Access& access,
                                                       std::optional<std::int64_t> before,
                                                       int limit) {
  return table_.list_scenes(access, before, limit);
}

Status SceneService::remove(const std::string& id, const Access& access,
                            const Assets::InUse& in_use) {
  if (const auto row = table_.find_scene(id, access); !row || !*row) {
    return row ? unknown_scene(id, "") : row.error();
  }
  const auto removal = table_.plan_removal(id, access);
  if (!removal) {
    return removal.error();
  }
  const auto needed = in_use(removal->scene_goes ? std::nullopt : std::optional(access.tenant));
  if (!needed) {
    return needed.error();
  }
  if (*needed) {
    return Error{ErrorCode::kConflict,
                 "a job uses the scene, or has finished and could be extended; delete it first",
                 ""};
  }
  const auto orphans = table_.remove_scene(id, access, *removal);
  if (!orphans) {
    return orphans.error();
  }
  if (removal->scene_goes) {
    scenes_.erase_prefix(id + "\n");
    later_.erase_prefix(id + "\n");
  }
  for (const std::string& asset : *orphans) {
    if (auto removed = assets_.remove_bytes(asset); !removed) {
      return removed;
    }
  }
  return core::ok_status();
}

core::Result<SceneService::EnvironmentSize> SceneService::size_of_environment(
    const std::string& asset) {
  {
    const core::MutexLock lock(sizes_mutex_);
    if (const auto known = environment_sizes_.find(asset); known != environment_sizes_.end()) {
      return known->second;
    }
  }
  const auto file_bytes = assets_.find(asset, Access::operators());
  if (!file_bytes) {
    return unknown_environment(asset);
  }
  const auto lease = memory_.take(*file_bytes, "the environment's file");
  if (!lease) {
    return lease.error();
  }
  const auto bytes = assets_.read(asset, Access::operators());
  if (!bytes) {  // damaged, or deleted in the meantime
    return bytes.error().code == ErrorCode::kNotFound ? unknown_environment(asset) : bytes.error();
  }
  const auto header = core::read_image_header(**bytes);
  if (!header) {
    return Error{ErrorCode::kInvalidArgument, header.error().message, "/environment/asset"};
  }
  const core::MutexLock lock(sizes_mutex_);
  return environment_sizes_[asset] = EnvironmentSize{
             .bytes = environment_bytes(*header),
             .load_bytes = *file_bytes + pixels_of(*header) * kEnvironmentLoadBytes};
}

Status SceneService::check_environment(const std::string& asset, const Access& access) {
  if (const auto found = assets_.find(asset, access); !found) {
    return unknown_environment(asset);
  }
  const auto size = size_of_environment(asset);
  return size ? core::ok_status() : Status(size.error());
}

SceneService::Memory SceneService::memory_of_scene(const std::string& id,
                                                   const core::SceneMoment& moment,
                                                   const SceneStand& stand) {
  std::string name = cache_key(id, moment, stand);
  if (const auto glb = builtin_glb(id)) {
    const core::MutexLock lock(builtin_mutex_);
    const auto known = builtin_bytes_.find(id);
    return {.name = std::move(name),
            .bytes = known == builtin_bytes_.end() ? 0 : known->second,
            .load_bytes = glb->size() * kLoadFactor};
  }
  const auto row = table_.find_scene(id, Access::operators());
  if (!row || !*row) {
    return {.name = std::move(name)};  // load() reports the error.
  }
  // Upper bound: each moving mesh is stored at up to kShutterSteps times.
  const std::uint64_t bytes =
      decode_facts((*row)->facts).bytes * (moment.shutter_seconds > 0 ? core::kShutterSteps : 1);
  const std::uint64_t load_bytes = load_bytes_of((*row)->facts);
  return {.name = std::move(name),
          .bytes = bytes,
          .load_bytes = load_bytes > 0 ? load_bytes : bytes * kLoadFactor};
}

/// Upper bound: the memory of the whole scene, which holds more than vertices.
SceneService::Memory SceneService::memory_of_later(const std::string& id,
                                                   const core::SceneMoment& moment) {
  Memory memory = memory_of_scene(id, moment);
  memory.name += "\nlater";
  return memory;
}

SceneService::Memory SceneService::memory_of_environment(
    const std::string& asset, const core::EnvironmentSettings& settings) {
  const auto size = size_of_environment(asset);
  return {.name = environment_key(asset, settings),
          .bytes = size ? size->bytes : 0,
          .load_bytes = size ? size->load_bytes : 0};
}

std::string SceneService::environment_warning(const std::string& asset) {
  const core::MutexLock lock(sizes_mutex_);
  const auto known = environment_warnings_.find(asset);
  return known == environment_warnings_.end() ? "" : known->second;
}

core::Result<std::shared_ptr<const core::Environment>> SceneService::environment(
    const std::optional<std::string>& asset, const core::EnvironmentSettings& settings,
    const LoadTerms& terms) {
  using Made = SingleFlightCache<core::Environment>::Made;
  if (!asset) {
    return core::make_environment(settings);
  }
  const std::string key = environment_key(*asset, settings);
  return environments_.get(
      key,
      [&]() -> core::Result<Made> {
        MemoryGate::Lease lease;
        if (terms.admission == LoadTerms::Admission::kNeeded) {
          const Memory needed = memory_of_environment(*asset, settings);
          auto taken =
              memory_.take({.bytes = needed.load_bytes, .shared = {{needed.name, needed.bytes}}},
                           "the environment");
          if (!taken) {
            return taken.error();
          }
          lease = *std::move(taken);
        }
        const auto at_asset = [](Error error) {
          error.where = "/environment/asset";
          return error;
        };
        const auto bytes = assets_.read(*asset, Access::operators());
        if (!bytes) {
          return at_asset(bytes.error());
        }
        const auto image = core::decode_image(**bytes, core::ImageLimits{});
        if (!image) {
          return at_asset(image.error());
        }
        auto environment = core::Environment::create(&*image, settings);
        if (!environment) {
          return at_asset(environment.error());
        }
        if (auto warning = core::radiance_warning(**bytes, *image, "the environment");
            !warning.empty()) {
          const core::MutexLock lock(sizes_mutex_);
          environment_warnings_[*asset] = std::move(warning);
        }
        const std::uint64_t held_bytes = environment_bytes(*image);
        auto held = memory_.note({.shared = {{key, held_bytes}}}, MemoryGate::Kind::kIdle);
        return Made{.value = with_lease(*std::move(environment), std::move(held)),
                    .bytes = held_bytes};
      },
      terms.stop);
}

}  // namespace server
