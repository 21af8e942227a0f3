// Uploads of scenes: files, archives, and assets that form one.

#include <algorithm>
#include <utility>

#include "api/job_view.h"
#include "api/json.h"
#include "core/base/sha256.h"
#include "core/scene_io/gltf_uri.h"
#include "server/observe/clock.h"
#include "server/scenes/scene_archive.h"
#include "server/scenes/scene_facts.h"
#include "server/scenes/scene_service.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// Memory is reserved in steps of this size.
constexpr std::uint64_t kStep = std::uint64_t{4} << 20U;

/// Reserves the memory of a scene while it is read.
class ReadingMemory {
 public:
  explicit ReadingMemory(MemoryGate::Lease& lease) : lease_(lease) {}
  Status take(std::uint64_t bytes) {
    wanted_ += bytes;
    if (wanted_ <= taken_) {
      return core::ok_status();
    }
    const std::uint64_t more = std::max(wanted_ - taken_, kStep);
    auto grown = lease_.grow(more);
    taken_ += grown ? more : 0;
    return grown;
  }

 private:
  MemoryGate::Lease& lease_;
  std::uint64_t wanted_ = 0;
  std::uint64_t taken_ = 0;
};

/// Returns options for reading a scene that reserve its memory through `memory`.
core::GltfOptions asking(ReadingMemory& memory) {
  core::GltfOptions options;
  options.limits.admit = [&memory](std::uint64_t bytes) { return memory.take(bytes); };
  return options;
}

std::string_view view_of(const core::Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A single file is its own id; several have the hash of the list of their names and contents.
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
                                                             MemoryGate::Lease lease,
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
    // An upload replaces stored files that have been damaged.
    for (const auto& [uri, bytes] : document.files) {
      if (known && !assets_.check(files[uri])) {
        static_cast<void>(assets_.put_for_scene(view_of(*bytes), unix_now()));
      }
    }
    if (known && !assets_.check(main_id)) {
      static_cast<void>(assets_.put_for_scene(view_of(*document.bytes), unix_now()));
    }
    return known;
  }
  const auto turn = uploads_.take(origin.access.tenant, origin.stop, std::nullopt);
  if (!turn) {
    return turn.error();
  }
  ReadingMemory memory(lease);
  auto scene = build(document, asking(memory), origin.stop);
  if (!scene) {
    return scene.error();
  }
  core::SceneSummary summary = (*scene)->summary();
  summary.name = origin.name.empty() ? summary.name : origin.name;
  // The lease holds the file and everything derived from it; the scene itself is counted by its
  // name.
  const std::uint64_t beside =
      std::max<std::uint64_t>(lease.bytes(), summary.bytes) - summary.bytes;
  SceneRow row{.sequence = 0,
               .id = id,
               .description = api::scene_json(id, summary),
               .facts = encode_facts(summary, beside),
               .created_at = unix_now(),
               .files = files};
  row.files[""] = main_id;
  document.files[""] = document.bytes;
  if (auto kept = keep(document, row, origin.access); !kept) {
    return kept.error();
  }
  const std::string key = cache_key(id, 0, std::nullopt, {});
  scenes_.put(key, held(key, *std::move(scene)));
  return Added{.id = id, .description = std::move(row.description), .known = false};
}

core::Result<SceneService::Added> SceneService::add_file(Upload file, const SceneOrigin& origin) {
  return add_document(
      Document{.bytes = std::make_shared<const core::Bytes>(std::move(file.content)), .files = {}},
      std::move(file.lease), origin);
}

core::Result<SceneService::Added> SceneService::add_zip(Upload upload, const SceneOrigin& origin) {
  const core::Bytes archive = std::move(upload.content);
  MemoryGate::Lease lease = std::move(upload.lease);
  const auto entries = read_zip_directory(archive, options_.zip);
  if (!entries) {
    return entries.error();
  }
  const auto main = main_document(*entries);
  if (!main) {
    return main.error();
  }
  if (auto room = lease.grow((*main)->bytes); !room) {
    return room.error();
  }
  auto content = read_zip_entry(archive, **main);
  if (!content) {
    return content.error();
  }
  Document document;
  document.bytes = std::make_shared<const core::Bytes>(std::move(*content));
  const std::uint64_t before = lease.bytes();
  ReadingMemory memory(lease);
  const auto uris = core::gltf_uris(*document.bytes, asking(memory).limits);
  if (!uris) {
    return uris.error();
  }
  lease.shrink_to(before);
  // Several names may refer to one entry, which is unpacked once.
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
      if (auto room = lease.grow(entry->bytes); !room) {
        return room.error();
      }
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
  return add_document(std::move(document), std::move(lease), origin);
}

core::Result<SceneService::Added> SceneService::add_from_assets(const api::SceneFromAssets& request,
                                                                const SceneOrigin& origin) {
  auto lease = memory_.take(0, "the scene");
  if (!lease) {
    return lease.error();
  }
  std::map<std::string, core::SharedBytes> known;  // Several names may refer to one asset.
  const auto read = [&](const std::string& asset,
                        const std::string& pointer) -> core::Result<core::SharedBytes> {
    if (const auto found = known.find(asset); found != known.end()) {
      return found->second;
    }
    const auto at_pointer = [&pointer](const Error& error) {
      return error.code == ErrorCode::kNotFound
                 ? Error{ErrorCode::kInvalidArgument, error.message, pointer}
                 : error;
    };
    const auto size = assets_.find(asset, origin.access);
    if (!size) {
      return at_pointer(size.error());
    }
    if (auto room = lease->grow(*size); !room) {
      return room.error();
    }
    auto bytes = assets_.read(asset, origin.access);
    if (!bytes) {  // removed in the meantime
      return at_pointer(bytes.error());
    }
    known[asset] = *bytes;
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
    // The request may use the document's spelling ("the%20buffer.bin") or the file's name, which
    // the loader uses.
    document.files[core::percent_decode(uri)] = std::move(*bytes);
  }
  return add_document(std::move(document), *std::move(lease), origin);
}

}  // namespace server
