// Uploads of scenes: files, archives, and assets that form one.

#include <algorithm>
#include <utility>

#include "api/answers/job_view.h"
#include "api/json/json.h"
#include "core/base/file_names.h"
#include "core/base/sha256.h"
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
  auto known = known_scene(id, origin.access);
  if (!known || known->known) {
    // An upload replaces stored files that have been damaged.
    for (const auto& [uri, bytes] : document.files) {
      if (known && !assets_.check(files[uri])) {
        static_cast<void>(assets_.put_for_scene(view_of(*bytes), unix_now()));
      }
    }
    if (known && !assets_.check(main_id)) {
      static_cast<void>(assets_.put_for_scene(view_of(*document.bytes), unix_now()));
    }
    if (!known || !origin.is_strict) {
      return known;
    }
  }
  const auto turn = uploads_.take(origin.access.tenant, origin.stop, std::nullopt);
  if (!turn) {
    return turn.error();
  }
  ReadingMemory memory(lease);
  core::GltfOptions options = asking(memory);
  options.is_strict = origin.is_strict;
  auto scene = build(document, options, origin.stop);
  if (!scene || known->known) {
    return scene ? known : scene.error();
  }
  core::SceneSummary summary = (*scene)->summary();
  summary.name = origin.name.empty() ? summary.name : origin.name;
  for (const std::string& note : origin.notes) {
    summary.warnings.emplace_back("converted", "", note);
  }
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
  const std::string key = cache_key(id, core::SceneMoment(), {});
  scenes_.put(key, held(key, *std::move(scene)));
  return Added{.id = id, .description = std::move(row.description), .known = false};
}

core::Result<SceneService::Added> SceneService::add_with_files(core::SharedBytes main,
                                                               const FindFile& find,
                                                               MemoryGate::Lease lease,
                                                               const SceneOrigin& origin) {
  const std::uint64_t before = lease.bytes();
  core::Result<std::vector<std::string>> names = std::vector<std::string>();
  {
    ReadingMemory memory(lease);
    const auto has = [&find](std::string_view name) { return find.has(name); };
    names = core::gltf_files(*main, has, asking(memory).limits);
  }
  if (!names) {
    return names.error();
  }
  lease.shrink_to(before);
  Document document{.bytes = std::move(main), .files = {}};
  Added added;
  for (const std::string& name : *names) {
    if (!find.has(name)) {
      added.missing.push_back(name);
      added.near.push_back(find.names.near(name));
      if (find.is_outside(name)) {
        added.outside.push_back(name);
      }
      continue;
    }
    auto bytes = find.read(name, lease);
    if (!bytes) {
      return bytes.error();
    }
    document.files[name] = *std::move(bytes);
  }
  return added.missing.empty() ? add_document(std::move(document), std::move(lease), origin)
                               : core::Result<Added>(std::move(added));
}

core::Result<SceneService::Added> SceneService::add_file(Upload file, const SceneOrigin& origin) {
  return add_with_sides(std::move(file), {}, origin);
}

core::Result<SceneService::Added> SceneService::add_with_sides(Upload document,
                                                               const std::vector<SideFile>& sides,
                                                               const SceneOrigin& origin) {
  core::FileNames names;
  core::FileNames last_parts;
  for (const SideFile& side : sides) {
    names.add(side.name);
    last_parts.add(std::string(core::last_part(side.name)));
  }
  const auto find = [&](std::string_view name) -> const SideFile* {
    auto at = names.find(name);
    at = at ? at : last_parts.find(core::last_part(name));
    return at ? &sides[*at] : nullptr;
  };
  const FindFile files = {
      [&find](std::string_view name) { return find(name) != nullptr; },
      [&find](std::string_view name, MemoryGate::Lease& lease) -> core::Result<core::SharedBytes> {
        const std::string_view content = find(name)->content;
        if (auto room = lease.grow(content.size()); !room) {
          return room.error();
        }
        const auto* bytes = reinterpret_cast<const std::byte*>(content.data());
        return std::make_shared<const core::Bytes>(bytes, bytes + content.size());
      },
      names};
  return add_with_files(std::make_shared<const core::Bytes>(std::move(document.content)), files,
                        std::move(document.lease), origin);
}

core::Result<SceneService::Added> SceneService::add_zip(Upload upload, const SceneOrigin& origin) {
  const core::Bytes archive = std::move(upload.content);
  const auto entries = core::read_zip_directory(archive, options_.zip);
  if (!entries) {
    return entries.error();
  }
  const auto main = main_document(*entries);
  if (!main) {
    return main.error();
  }
  // Several names may refer to one entry, which is unpacked once.
  std::map<const core::ZipEntry*, core::SharedBytes> unpacked;
  const auto unpack = [&](const core::ZipEntry& entry,
                          MemoryGate::Lease& lease) -> core::Result<core::SharedBytes> {
    core::SharedBytes& content = unpacked[&entry];
    if (!content) {
      if (auto room = lease.grow(entry.bytes); !room) {
        return room.error();
      }
      auto bytes = core::read_zip_entry(archive, entry);
      if (!bytes) {
        return bytes.error();
      }
      content = std::make_shared<const core::Bytes>(*std::move(bytes));
    }
    return content;
  };
  auto document = unpack(**main, upload.lease);
  if (!document) {
    return document.error();
  }
  const ArchiveFiles files(*entries, (*main)->name);
  const FindFile find = {[&files](std::string_view name) { return files.find(name) != nullptr; },
                         [&](std::string_view name, MemoryGate::Lease& lease) {
                           return unpack(*files.find(name), lease);
                         },
                         files.names(),
                         [&files](std::string_view name) { return files.is_outside(name); }};
  return add_with_files(*std::move(document), find, std::move(upload.lease), origin);
}

core::Result<SceneService::Added> SceneService::add_from_assets(const api::SceneFromAssets& request,
                                                                const SceneOrigin& origin) {
  auto lease = memory_.take({.tenant = origin.access.tenant}, "the scene");
  if (!lease) {
    return lease.error();
  }
  std::map<std::string, core::SharedBytes> known;  // Several names may refer to one asset.
  const auto at_pointer = [](const Error& error, const std::string& pointer) {
    return error.code == ErrorCode::kNotFound
               ? Error{ErrorCode::kInvalidArgument, error.message, pointer}
               : error;
  };
  const auto read = [&](const std::string& asset, const std::string& pointer,
                        MemoryGate::Lease& memory) -> core::Result<core::SharedBytes> {
    if (const auto found = known.find(asset); found != known.end()) {
      return found->second;
    }
    const auto size = assets_.find(asset, origin.access);
    if (!size) {
      return at_pointer(size.error(), pointer);
    }
    if (auto room = memory.grow(*size); !room) {
      return room.error();
    }
    auto bytes = assets_.read(asset, origin.access);
    if (!bytes) {  // removed in the meantime
      return at_pointer(bytes.error(), pointer);
    }
    known[asset] = *bytes;
    return bytes;
  };
  auto main = read(request.gltf, "/gltf", *lease);
  if (!main) {
    return main.error();
  }
  // The request may use the file's name, which the loader uses, or the document's spelling
  // ("the%20buffer.bin").
  std::map<std::string, std::string, std::less<>> spelled;
  for (const auto& [uri, asset] : request.files) {
    if (const auto found = assets_.find(asset, origin.access); !found) {
      return at_pointer(found.error(), api::join_pointer("/files", uri));
    }
    spelled.emplace(core::percent_decode(uri), uri);
  }
  for (const auto& [uri, asset] : request.files) {
    spelled[uri] = uri;
  }
  core::FileNames names;
  std::vector<std::string> uris;
  for (const auto& [name, uri] : spelled) {
    names.add(name);
    uris.push_back(uri);
  }
  const auto place_of = [&names](std::string_view name) {
    const auto exact = names.find(name);
    const auto plain = exact ? std::nullopt : core::plain_name(core::with_slashes(name));
    return plain ? names.find(*plain) : exact;
  };
  const FindFile find = {[&](std::string_view name) { return place_of(name).has_value(); },
                         [&](std::string_view name, MemoryGate::Lease& memory) {
                           const std::string& uri = uris[*place_of(name)];
                           return read(request.files.at(uri), api::join_pointer("/files", uri),
                                       memory);
                         },
                         names};
  return add_with_files(*std::move(main), find, *std::move(lease), origin);
}

}  // namespace server
