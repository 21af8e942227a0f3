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
#include "server/scenes/scene_facts.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

constexpr int kUploadsAtATime = 2;

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

/// `uri` seen from the folder of `document`, without `.` and `..`; empty when it leaves the archive.
std::string path_in_archive(std::string_view document, std::string_view uri) {
  const auto slash = document.rfind('/');
  std::string path(slash == std::string_view::npos ? std::string_view() : document.substr(0, slash));
  while (!uri.empty()) {
    const auto next = uri.find('/');
    const std::string_view part = uri.substr(0, next);
    uri = next == std::string_view::npos ? std::string_view() : uri.substr(next + 1);
    if (part.empty() || part == ".") {
      continue;
    }
    if (part == "..") {
      if (path.empty()) {
        return {};
      }
      const auto parent = path.rfind('/');
      path.resize(parent == std::string::npos ? 0 : parent);
      continue;
    }
    path += path.empty() ? "" : "/";
    path += part;
  }
  return path;
}

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

/// The one .glb or .gltf of an archive; of several the one in the topmost folder.
core::Result<const ZipEntry*> main_document(const std::vector<ZipEntry>& entries) {
  const ZipEntry* best = nullptr;
  std::ptrdiff_t best_depth = 0;
  bool tie = false;
  for (const ZipEntry& entry : entries) {
    if (!ends_with(entry.name, ".glb") && !ends_with(entry.name, ".gltf")) {
      continue;
    }
    const auto depth = std::count(entry.name.begin(), entry.name.end(), '/');
    if (best == nullptr || depth < best_depth) {
      best = &entry;
      best_depth = depth;
      tie = false;
    } else {
      tie = tie || depth == best_depth;
    }
  }
  if (best == nullptr || tie) {
    return Error{ErrorCode::kInvalidArgument,
                 best == nullptr ? "the archive holds no .glb and no .gltf"
                                 : "the archive holds several .glb or .gltf files side by side",
                 ""};
  }
  return best;
}

}  // namespace

SceneService::SceneService(BlobStore& blobs, SceneTable& table, StorageQuota& quota, SceneServiceOptions options)
    : blobs_(blobs),
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
  const auto row = table_.find_scene(id);
  if (!row) {
    return row.error();
  }
  if (!*row) {
    return unknown_scene(id, "");
  }
  Document document;
  for (const auto& [uri, asset] : (*row)->files) {
    auto bytes = blobs_.read(asset);
    if (!bytes) {
      return bytes.error();
    }
    if (uri.empty()) {
      document.bytes = std::move(*bytes);
    } else {
      document.files[uri] = std::move(*bytes);
    }
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
    core::GltfOptions options;
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

core::Result<SceneService::Added> SceneService::known_scene(const std::string& id) {
  auto row = table_.find_scene(id);
  if (!row) {
    return row.error();
  }
  if (!*row) {
    return Added{};
  }
  return Added{.id = id, .description = std::move((*row)->description), .known = true};
}

Status SceneService::keep(const Document& document, const SceneRow& row, const std::string& owner) {
  const std::shared_lock<std::shared_mutex> naming(names_mutex_);
  std::uint64_t fresh_bytes = 0;
  for (const auto& [uri, asset] : row.files) {
    fresh_bytes += blobs_.find(asset) ? 0 : document.files.at(uri)->size();
  }
  StorageQuota::Room room = quota_.room(owner, StorageQuota::Kind::kAsset);
  if (auto fits = room.grow_to(fresh_bytes); !fits) {
    return fits;
  }
  for (const auto& [uri, bytes] : document.files) {
    const auto stored = blobs_.put(view_of(*bytes));
    if (!stored) {
      return stored.error();
    }
    if (auto kept = table_.insert_asset({.id = stored->id,
                                         .bytes = stored->bytes,
                                         .uploaded = false,
                                         .created_at = row.created_at,
                                         .owner = owner});
        !kept) {
      return kept;
    }
  }
  return table_.insert_scene(row);
}

core::Result<SceneService::Added> SceneService::add_document(Document document, const SceneOrigin& origin) {
  SceneFiles files;
  for (const auto& [uri, bytes] : document.files) {
    files[uri] = core::sha256_hex(bytes->data(), bytes->size());
  }
  const std::string main_id = core::sha256_hex(document.bytes->data(), document.bytes->size());
  const std::string id = scene_id(main_id, files);
  if (auto known = known_scene(id); !known || known->known) {
    return known;
  }
  uploads_.acquire();
  struct Release {
    std::counting_semaphore<64>& semaphore;
    ~Release() { semaphore.release(); }
  } const release{uploads_};
  auto scene = build(document, core::GltfOptions{});
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
  if (auto kept = keep(document, row, origin.owner); !kept) {
    return kept.error();
  }
  scenes_.put(cache_key(id, 0, std::nullopt), {.value = *scene, .bytes = summary.bytes});
  return Added{.id = id, .description = std::move(row.description), .known = false};
}

core::Result<SceneService::Added> SceneService::add_file(core::Bytes content, const SceneOrigin& origin) {
  return add_document(
      Document{.bytes = std::make_shared<const core::Bytes>(std::move(content)), .files = {}}, origin);
}

core::Result<SceneService::Added> SceneService::add_zip(core::Bytes archive, const SceneOrigin& origin) {
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
  std::string missing;
  for (const std::string& uri : *uris) {
    const std::string path = path_in_archive((*main)->name, uri);
    const auto entry = std::find_if(entries->begin(), entries->end(),
                                    [&](const ZipEntry& candidate) { return candidate.name == path; });
    if (path.empty() || entry == entries->end()) {
      missing += (missing.empty() ? "" : ", ") + uri;
      continue;
    }
    auto bytes = read_zip_entry(archive, *entry);
    if (!bytes) {
      return bytes.error();
    }
    document.files[uri] = std::make_shared<const core::Bytes>(std::move(*bytes));
  }
  if (!missing.empty()) {
    return Error{ErrorCode::kMissingFiles, "the archive lacks files that the scene names: " + missing,
                 ""};
  }
  return add_document(std::move(document), origin);
}

core::Result<SceneService::Added> SceneService::add_from_assets(const api::SceneFromAssets& request,
                                                                const SceneOrigin& origin) {
  const auto read = [this](const std::string& asset,
                           const std::string& pointer) -> core::Result<core::SharedBytes> {
    auto bytes = blobs_.read(asset);
    if (!bytes && bytes.error().code == ErrorCode::kNotFound) {
      return Error{ErrorCode::kInvalidArgument, "no asset has the id \"" + asset + "\"", pointer};
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

core::Result<std::string> SceneService::description(const std::string& id) {
  if (core::find_builtin_scene(id) != nullptr) {
    const auto scene = load(id, 0, std::nullopt);
    if (!scene) {
      return scene.error();
    }
    return api::scene_json(id, (*scene)->summary());
  }
  auto row = table_.find_scene(id);
  if (!row) {
    return row.error();
  }
  if (!*row) {
    return unknown_scene(id, "");
  }
  return std::move((*row)->description);
}

core::Result<core::SceneSummary> SceneService::facts(const std::string& id) {
  if (core::find_builtin_scene(id) != nullptr) {
    const auto scene = load(id, 0, std::nullopt);
    if (!scene) {
      return scene.error();
    }
    return decode_facts(encode_facts((*scene)->summary()));
  }
  const auto row = table_.find_scene(id);
  if (!row) {
    return row.error();
  }
  if (!*row) {
    return unknown_scene(id, "/scene");
  }
  return decode_facts((*row)->facts);
}

core::Result<std::vector<SceneRow>> SceneService::list(std::optional<std::int64_t> before, int limit) {
  return table_.list_scenes(before, limit);
}

Status SceneService::remove(const std::string& id) {
  if (const auto row = table_.find_scene(id); !row || !*row) {
    return row ? unknown_scene(id, "") : row.error();
  }
  const auto orphans = table_.remove_scene(id);
  if (!orphans) {
    return orphans.error();
  }
  scenes_.erase_prefix(id + "\n");
  for (const std::string& asset : *orphans) {
    if (auto removed = blobs_.remove(asset); !removed) {
      return removed;
    }
  }
  return core::ok_status();
}

core::Result<std::uint64_t> SceneService::size_of_environment(const std::string& asset) {
  const Error unknown{ErrorCode::kInvalidArgument, "no asset has the id \"" + asset + "\"", "/environment/asset"};
  if (!blobs_.find(asset)) {
    return unknown;
  }
  {
    const core::MutexLock lock(sizes_mutex_);
    if (const auto known = environment_sizes_.find(asset); known != environment_sizes_.end()) {
      return known->second;
    }
  }
  const auto bytes = blobs_.read(asset);
  if (!bytes) {
    return unknown;
  }
  const auto header = core::read_image_header(**bytes);
  if (!header) {
    return Error{ErrorCode::kInvalidArgument, header.error().message, "/environment/asset"};
  }
  const core::MutexLock lock(sizes_mutex_);
  return environment_sizes_[asset] = environment_bytes(*header);
}

Status SceneService::check_environment(const std::string& asset) {
  const auto size = size_of_environment(asset);
  return size ? core::ok_status() : Status(size.error());
}

SceneService::Memory SceneService::memory_of_scene(const std::string& id, double time_seconds,
                                                   const std::optional<std::string>& variant) {
  const auto summary = facts(id);
  return {.name = cache_key(id, time_seconds, variant), .bytes = summary ? summary->bytes : 0};
}

SceneService::Memory SceneService::memory_of_environment(const std::string& asset,
                                                         const core::EnvironmentSettings& settings) {
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
    const auto bytes = blobs_.read(*asset);
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
