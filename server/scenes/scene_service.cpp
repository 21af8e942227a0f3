#include "server/scenes/scene_service.h"

#include <algorithm>
#include <utility>

#include "api/job_view.h"
#include "api/json.h"
#include "core/base/sha256.h"
#include "core/image_io/image_io.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/scene_io/gltf_uri.h"
#include "server/observe/clock.h"
#include "server/observe/machine_memory.h"
#include "server/scenes/scene_archive.h"
#include "server/scenes/scene_facts.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

constexpr int kUploadsAtATime = 2;

/// What reading a scene may take: half of what jobs have by default, as building it takes as much
/// again; 8 GiB at most.
core::GltfOptions bounded_options() {
  core::GltfOptions options;
  if (static const std::uint64_t usable = usable_memory_bytes(); usable > 0) {
    options.limits.decoded_bytes_max =
        std::min<std::uint64_t>(options.limits.decoded_bytes_max, usable / 100 * 35);
  }
  return options;
}

std::string cache_key(const std::string& id, double time_seconds,
                      const std::optional<std::string>& variant) {
  return id + "\n" + std::to_string(time_seconds) + "\n" + (variant ? "=" + *variant : "");
}

std::string environment_key(const std::string& asset, const core::EnvironmentSettings& settings) {
  std::string key = asset;
  for (const float number : {settings.color.r, settings.color.g, settings.color.b,
                             settings.intensity, settings.rotation_degrees}) {
    key += " " + api::number_text(api::shortest_double(number));
  }
  return key + (settings.visible ? " visible" : "");
}

/// Texels, and a distribution over them.
std::uint64_t environment_bytes(const core::Image& image) {
  return static_cast<std::uint64_t>(image.width) * static_cast<std::uint64_t>(image.height) * 20U;
}

std::string_view view_of(const core::Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Error unknown_scene(const std::string& id, std::string where) {
  std::string text = "no scene has the id \"" + id + "\"; built in are";
  for (const core::BuiltinScene& scene : core::builtin_scenes()) {
    text += " " + std::string(scene.name);
  }
  return Error{ErrorCode::kNotFound, std::move(text), std::move(where)};
}

Error unknown_environment(const std::string& asset) {
  return Error{ErrorCode::kInvalidArgument, "no asset has the id \"" + asset + "\"",
               "/environment/asset"};
}

/// One file names itself; several are named by the list of their names and contents.
std::string scene_id(const std::string& main_id, const SceneFiles& files) {
  if (files.empty()) {
    return main_id;
  }
  std::string list = "tessera scene 1\n" + main_id + "\n";
  for (const auto& [uri, asset] : files) {
    list += asset + " " + std::to_string(uri.size()) + " " + uri + "\n";
  }
  return core::sha256_hex(list.data(), list.size());
}

}  // namespace

SceneService::SceneService(Assets& assets, SceneTable& table, StorageQuota& quota,
                           SceneServiceOptions options)
    : assets_(assets),
      table_(table),
      quota_(quota),
      options_(std::move(options)),
      scenes_(options_.cache_bytes),
      environments_(options_.environment_cache_bytes),
      uploads_(kUploadsAtATime) {}

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

core::Result<std::shared_ptr<const core::Scene>> SceneService::build(
    const Document& document, const core::GltfOptions& options) {
  const auto resolve = [&document](std::string_view uri) -> core::SharedBytes {
    const auto found = document.files.find(std::string(uri));
    return found == document.files.end() ? nullptr : found->second;
  };
  auto description = core::load_gltf(*document.bytes, resolve, options);
  if (!description) {
    return description.error();
  }
  return core::Scene::build(std::move(*description), options_.threads, options_.isa);
}

core::Result<std::shared_ptr<const core::Scene>> SceneService::load(
    const std::string& id, double time_seconds, const std::optional<std::string>& variant) {
  using Made = SingleFlightCache<core::Scene>::Made;
  return scenes_.get(cache_key(id, time_seconds, variant), [&]() -> core::Result<Made> {
    const auto document = document_of(id);
    if (!document) {
      return document.error();
    }
    core::GltfOptions options = bounded_options();
    options.time_seconds = time_seconds;
    options.variant = variant;
    auto scene = build(*document, options);
    if (!scene) {
      return scene.error();
    }
    const std::uint64_t bytes = (*scene)->summary().bytes;
    return Made{.value = std::move(*scene), .bytes = bytes};
  });
}

core::Result<SceneService::Added> SceneService::known_scene(const std::string& id,
                                                            const Access& access) {
  const auto kept = table_.keeps(id, access);
  auto row = table_.find_scene(id, access);
  if (!kept || !row) {
    return kept ? row.error() : kept.error();
  }
  if (!*kept || !*row) {
    return Added{};
  }
  return Added{.id = id, .description = std::move((*row)->description), .known = true};
}

Status SceneService::keep(const Document& document, const SceneRow& row, const Access& access) {
  const std::shared_lock<std::shared_mutex> naming(names_mutex_);
  std::map<std::string, core::SharedBytes> contents;
  std::uint64_t fresh_bytes = 0;
  for (const auto& [uri, asset] : row.files) {
    const auto kept = assets_.keeps(asset, access);
    if (!kept) {
      return kept.error();
    }
    const auto& bytes = document.files.at(uri);
    const bool is_fresh = contents.emplace(asset, bytes).second && !*kept;
    fresh_bytes += is_fresh ? bytes->size() : 0;
  }
  StorageQuota::Room room = quota_.room(access.tenant, StorageQuota::Kind::kAsset);
  if (auto fits = room.grow_to(fresh_bytes); !fits) {
    return fits;
  }
  for (const auto& [asset, bytes] : contents) {
    if (const auto stored = assets_.put_for_scene(view_of(*bytes), row.created_at); !stored) {
      return stored.error();
    }
  }
  return table_.insert_scene(row, access);
}

core::Result<SceneService::Added> SceneService::add_document(Document document,
                                                             const SceneOrigin& origin) {
  SceneFiles files;
  std::map<const core::Bytes*, std::string> ids;  // One file may have many names.
  for (const auto& [uri, bytes] : document.files) {
    std::string& id = ids[bytes.get()];
    id = id.empty() ? core::sha256_hex(bytes->data(), bytes->size()) : id;
    files[uri] = id;
  }
  const std::string main_id = core::sha256_hex(document.bytes->data(), document.bytes->size());
  const std::string id = scene_id(main_id, files);
  if (auto known = known_scene(id, origin.access); !known || known->known) {
    return known;
  }
  uploads_.acquire();
  struct Release {
    std::counting_semaphore<64>& semaphore;
    ~Release() { semaphore.release(); }
  } const release{uploads_};
  auto scene = build(document, bounded_options());
  if (!scene) {
    return scene.error();
  }
  core::SceneSummary summary = (*scene)->summary();
  summary.name = origin.name.empty() ? summary.name : origin.name;
  SceneRow row{.sequence = 0,
               .id = id,
               .description = api::scene_json(id, summary),
               .facts = encode_facts(summary),
               .created_at = unix_now(),
               .files = files};
  row.files[""] = main_id;
  document.files[""] = document.bytes;
  if (auto kept = keep(document, row, origin.access); !kept) {
    return kept.error();
  }
  scenes_.put(cache_key(id, 0, std::nullopt), {.value = *scene, .bytes = summary.bytes});
  return Added{.id = id, .description = std::move(row.description), .known = false};
}

core::Result<SceneService::Added> SceneService::add_file(core::Bytes content,
                                                         const SceneOrigin& origin) {
  return add_document(
      Document{.bytes = std::make_shared<const core::Bytes>(std::move(content)), .files = {}},
      origin);
}

core::Result<SceneService::Added> SceneService::add_zip(core::Bytes archive,
                                                        const SceneOrigin& origin) {
  const auto entries = read_zip_directory(archive, options_.zip);
  if (!entries) {
    return entries.error();
  }
  const auto main = main_document(*entries);
  if (!main) {
    return main.error();
  }
  auto content = read_zip_entry(archive, **main);
  if (!content) {
    return content.error();
  }
  Document document;
  document.bytes = std::make_shared<const core::Bytes>(std::move(*content));
  const auto uris = core::gltf_uris(*document.bytes);
  if (!uris) {
    return uris.error();
  }
  // Many names may mean one entry: it is unpacked once.
  std::map<std::string, core::SharedBytes> unpacked;
  std::vector<std::string> missing;
  for (const std::string& uri : *uris) {
    const std::string path = path_in_archive((*main)->name, uri);
    const auto entry =
        std::find_if(entries->begin(), entries->end(),
                     [&](const ZipEntry& candidate) { return candidate.name == path; });
    if (path.empty() || entry == entries->end()) {
      missing.push_back(uri);
      continue;
    }
    core::SharedBytes& content_of_path = unpacked[path];
    if (!content_of_path) {
      auto bytes = read_zip_entry(archive, *entry);
      if (!bytes) {
        return bytes.error();
      }
      content_of_path = std::make_shared<const core::Bytes>(std::move(*bytes));
    }
    document.files[uri] = content_of_path;
  }
  if (!missing.empty()) {
    return core::missing_files("the archive lacks files that the scene names", missing);
  }
  return add_document(std::move(document), origin);
}

core::Result<SceneService::Added> SceneService::add_from_assets(const api::SceneFromAssets& request,
                                                                const SceneOrigin& origin) {
  std::map<std::string, core::SharedBytes> known;  // Many names may mean one asset.
  const auto read = [&](const std::string& asset,
                        const std::string& pointer) -> core::Result<core::SharedBytes> {
    if (const auto found = known.find(asset); found != known.end()) {
      return found->second;
    }
    auto bytes = assets_.read(asset, origin.access);
    if (!bytes && bytes.error().code == ErrorCode::kNotFound) {
      return Error{ErrorCode::kInvalidArgument, bytes.error().message, pointer};
    }
    if (bytes) {
      known[asset] = *bytes;
    }
    return bytes;
  };
  Document document;
  auto main = read(request.gltf, "/gltf");
  if (!main) {
    return main.error();
  }
  document.bytes = std::move(*main);
  for (const auto& [uri, asset] : request.files) {
    auto bytes = read(asset, api::join_pointer("/files", uri));
    if (!bytes) {
      return bytes.error();
    }
    // As the document writes it ("the%20buffer.bin") or as the file is called: the loader asks for
    // the latter.
    document.files[core::percent_decode(uri)] = std::move(*bytes);
  }
  return add_document(std::move(document), origin);
}

core::Result<std::string> SceneService::description(const std::string& id, const Access& access) {
  if (core::find_builtin_scene(id) != nullptr) {
    const auto scene = load(id, 0, std::nullopt);
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
    const auto scene = load(id, 0, std::nullopt);
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
  return decode_facts((*row)->facts);
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
  }
  for (const std::string& asset : *orphans) {
    if (auto removed = assets_.remove_bytes(asset); !removed) {
      return removed;
    }
  }
  return core::ok_status();
}

core::Result<std::uint64_t> SceneService::size_of_environment(const std::string& asset) {
  {
    const core::MutexLock lock(sizes_mutex_);
    if (const auto known = environment_sizes_.find(asset); known != environment_sizes_.end()) {
      return known->second;
    }
  }
  const auto bytes = assets_.read(asset, Access::operators());
  if (!bytes) {
    return unknown_environment(asset);
  }
  const auto header = core::read_image_header(**bytes);
  if (!header) {
    return Error{ErrorCode::kInvalidArgument, header.error().message, "/environment/asset"};
  }
  const core::MutexLock lock(sizes_mutex_);
  return environment_sizes_[asset] = environment_bytes(*header);
}

Status SceneService::check_environment(const std::string& asset, const Access& access) {
  if (const auto found = assets_.find(asset, access); !found) {
    return unknown_environment(asset);
  }
  const auto size = size_of_environment(asset);
  return size ? core::ok_status() : Status(size.error());
}

SceneService::Memory SceneService::memory_of_scene(const std::string& id, double time_seconds,
                                                   const std::optional<std::string>& variant) {
  const auto summary = facts(id, Access::operators());
  return {.name = cache_key(id, time_seconds, variant), .bytes = summary ? summary->bytes : 0};
}

SceneService::Memory SceneService::memory_of_environment(
    const std::string& asset, const core::EnvironmentSettings& settings) {
  const auto size = size_of_environment(asset);
  return {.name = environment_key(asset, settings), .bytes = size ? *size : 0};
}

core::Result<std::shared_ptr<const core::Environment>> SceneService::environment(
    const std::optional<std::string>& asset, const core::EnvironmentSettings& settings) {
  using Made = SingleFlightCache<core::Environment>::Made;
  if (!asset) {
    return core::Environment::create(nullptr, settings);
  }
  return environments_.get(environment_key(*asset, settings), [&]() -> core::Result<Made> {
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
    return Made{.value = std::move(*environment), .bytes = environment_bytes(*image)};
  });
}

}  // namespace server
