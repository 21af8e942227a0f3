#include "server/store/assets.h"

#include "server/store/columns.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

constexpr const char* kOfTenant =
    "(EXISTS (SELECT 1 FROM asset_tenants WHERE asset=assets.id AND tenant=?)"
    " OR EXISTS (SELECT 1 FROM scene_files JOIN scene_tenants USING(scene)"
    " WHERE asset=assets.id AND tenant=?))";

Error unknown_asset(std::string_view id) {
  return Error{ErrorCode::kNotFound, "no asset has the id \"" + std::string(id) + "\"", ""};
}

/// Effects of a removal.
struct Removal {
  bool of_all = false;  ///< The references of all tenants, otherwise only the requesting tenant's.
  bool has_scene = false;
  bool bytes_go = false;
};

core::Result<Removal> plan_removal(Database& database, std::string_view id, const Access& access) {
  auto session = database.session();
  Statement counted = session.prepare(
      "SELECT COUNT(*), COALESCE(SUM(tenant=?), 0) FROM asset_tenants WHERE asset=?");
  const auto references = references_to(id, access, counted);
  if (!references) {
    return references.error();
  }
  Removal removal;
  removal.of_all = references->of_all;
  Statement scenes = session.prepare("SELECT COUNT(*) FROM scene_files WHERE asset=?");
  const auto in_scenes = first_integer(scenes.bind(id));
  Statement own = session.prepare(
      "SELECT COUNT(*) FROM scene_files JOIN scene_tenants USING(scene) WHERE asset=? AND "
      "tenant=?");
  const auto in_own_scenes = first_integer(own.bind(id).bind(access.tenant));
  if (!in_scenes || !in_own_scenes) {
    return in_scenes ? in_own_scenes.error() : in_scenes.error();
  }
  removal.has_scene = (removal.of_all ? *in_scenes : *in_own_scenes) > 0;
  removal.bytes_go = *in_scenes == 0 && (removal.of_all || references->count == 1);
  return removal;
}

}  // namespace

core::Result<std::uint64_t> Assets::find(std::string_view id, const Access& access) {
  auto session = database_.session();
  std::string sql = "SELECT bytes FROM assets WHERE id=?";
  sql += access.sees_all() ? "" : " AND ";
  sql += access.sees_all() ? "" : kOfTenant;
  Statement select = session.prepare(sql.c_str());
  select.bind(id);
  if (!access.sees_all()) {
    select.bind(access.tenant).bind(access.tenant);
  }
  const bool found = select.step();
  const auto bytes = found ? static_cast<std::uint64_t>(select.integer(0)) : 0;
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  return found ? core::Result<std::uint64_t>(bytes) : unknown_asset(id);
}

core::Result<core::SharedBytes> Assets::read(std::string_view id, const Access& access) {
  const auto found = find(id, access);
  return found ? blobs_.read(id) : core::Result<core::SharedBytes>(found.error());
}

core::Result<UniqueFd> Assets::open(std::string_view id, const Access& access) {
  const auto found = find(id, access);
  return found ? blobs_.open_blob(id) : core::Result<UniqueFd>(found.error());
}

core::Result<bool> Assets::keeps(std::string_view id, const Access& access) {
  const auto found = find(id, access.is_shared() ? access : Access::of(access.tenant));
  if (!found && found.error().code != ErrorCode::kNotFound) {
    return found.error();
  }
  return found.has_value();
}

core::Result<bool> Assets::was_uploaded(std::string_view id) {
  auto session = database_.session();
  Statement select = session.prepare("SELECT COUNT(*) FROM asset_tenants WHERE asset=?");
  const auto tenants = first_integer(select.bind(id));
  return tenants ? core::Result<bool>(*tenants > 0) : core::Result<bool>(tenants.error());
}

Status Assets::insert(const StoredBlob& blob, double now) {
  auto session = database_.session();
  Statement insert = session.prepare(
      "INSERT INTO assets(id, bytes, created_at) VALUES(?,?,?) ON CONFLICT(id) DO NOTHING");
  return insert.bind(blob.id).bind(static_cast<std::int64_t>(blob.bytes)).bind(now).run();
}

core::Result<bool> Assets::keep(const StoredBlob& blob, const Access& access, double now) {
  const auto known = keeps(blob.id, access);
  if (!known) {
    return known.error();
  }
  if (auto inserted = insert(blob, now); !inserted) {
    return inserted.error();
  }
  auto session = database_.session();
  Statement refer = session.prepare(
      access.is_shared()
          ? "INSERT INTO asset_tenants(asset, tenant, created_at) SELECT ?1, ?2, ?3"
            " WHERE NOT EXISTS (SELECT 1 FROM asset_tenants WHERE asset=?1)"
          : "INSERT OR IGNORE INTO asset_tenants(asset, tenant, created_at) VALUES(?1, ?2, ?3)");
  if (auto kept = refer.bind(blob.id).bind(access.tenant).bind(now).run(); !kept) {
    return kept.error();
  }
  return *known;
}

core::Result<StoredBlob> Assets::put_for_scene(std::string_view content, double now) {
  auto stored = blobs_.put(content);
  if (!stored) {
    return stored;
  }
  if (const auto inserted = insert(*stored, now); !inserted) {
    return inserted.error();
  }
  return stored;
}

Status Assets::remove(std::string_view id, const Access& access, const InUse& in_use) {
  if (const auto found = find(id, access); !found) {
    return found.error();
  }
  const auto removal = plan_removal(database_, id, access);
  if (!removal) {
    return removal.error();
  }
  if (removal->has_scene) {
    return Error{ErrorCode::kConflict, "a scene uses the asset", ""};
  }
  const auto needed = in_use(removal->bytes_go ? std::nullopt : std::optional(access.tenant));
  if (!needed) {
    return needed.error();
  }
  if (*needed) {
    return Error{ErrorCode::kConflict, "a job uses the asset", ""};
  }
  const Status dropped = database_.transact([&](Database::Session& session) -> Status {
    if (removal->bytes_go) {
      return session.prepare("DELETE FROM assets WHERE id=?").bind(id).run();
    }
    Statement drop = session.prepare("DELETE FROM asset_tenants WHERE asset=? AND tenant=?");
    return drop.bind(id).bind(access.tenant).run();
  });
  return dropped && removal->bytes_go ? blobs_.remove(id) : dropped;
}

}  // namespace server
