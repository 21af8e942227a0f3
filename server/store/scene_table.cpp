#include "server/store/scene_table.h"

#include <limits>

#include "server/store/columns.h"

namespace server {

using core::Status;

namespace {

Status insert_files(Database::Session& session, const SceneRow& row) {
  for (const auto& [uri, asset] : row.files) {
    Statement file = session.prepare(
        "INSERT INTO scene_files(scene, uri, asset) VALUES(?,?,?) ON CONFLICT DO NOTHING");
    if (auto status = file.bind(row.id).bind(uri).bind(asset).run(); !status) {
      return status;
    }
  }
  return core::ok_status();
}

}  // namespace

Status SceneTable::insert_scene(const SceneRow& row, const Access& access) {
  const auto work = [&](Database::Session& session) -> Status {
    Statement insert = session.prepare(
        "INSERT INTO scenes(id, facts, created_at) VALUES(?,?,?) ON CONFLICT(id) DO NOTHING");
    if (auto status = insert.bind(row.id).bind(row.facts).bind(row.created_at).run(); !status) {
      return status;
    }
    if (auto status = insert_files(session, row); !status) {
      return status;
    }
    Statement refer = session.prepare(
        "INSERT INTO scene_tenants(scene, tenant, description, created_at) VALUES(?,?,?,?)"
        " ON CONFLICT DO NOTHING");
    refer.bind(row.id).bind(access.tenant).bind(row.description);
    return refer.bind(row.created_at).run();
  };
  return database_.transact(work, Database::Spend::kFreeSpace);
}

Status SceneTable::set_facts(std::string_view id, std::string_view facts) {
  const auto work = [&](Database::Session& session) {
    return session.prepare("UPDATE scenes SET facts=? WHERE id=?").bind(facts).bind(id).run();
  };
  return database_.transact(work, Database::Spend::kFreeSpace);
}

core::Result<std::optional<SceneRow>> SceneTable::find_scene(std::string_view id,
                                                             const Access& access) {
  auto session = database_.session();
  std::optional<SceneRow> row;
  Statement select = session.prepare(
      "SELECT scene_tenants.sequence, id, description, facts, scene_tenants.created_at"
      " FROM scene_tenants JOIN scenes ON id=scene WHERE scene=? AND (? OR tenant=?)"
      " ORDER BY tenant=? DESC, scene_tenants.sequence DESC LIMIT 1");
  select.bind(id).bind(std::int64_t{access.sees_all() ? 1 : 0});
  if (select.bind(access.tenant).bind(access.tenant).step()) {
    row = SceneRow{.sequence = select.integer(0),
                   .id = select.text(1),
                   .description = select.text(2),
                   .facts = select.text(3),
                   .created_at = select.real(4),
                   .files = {}};
  }
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  if (row) {
    Statement files = session.prepare("SELECT uri, asset FROM scene_files WHERE scene=?");
    files.bind(id);
    while (files.step()) {
      row->files[files.text(0)] = files.text(1);
    }
    if (const auto status = files.status(); !status) {
      return status.error();
    }
  }
  return row;
}

core::Result<bool> SceneTable::keeps(std::string_view id, const Access& access) {
  auto session = database_.session();
  Statement select =
      session.prepare("SELECT 1 FROM scene_tenants WHERE scene=? AND (? OR tenant=?) LIMIT 1");
  select.bind(id).bind(std::int64_t{access.is_shared() ? 1 : 0}).bind(access.tenant);
  return has_row(select);
}

core::Result<std::vector<SceneRow>> SceneTable::list_scenes(const Access& access,
                                                            std::optional<std::int64_t> before,
                                                            int limit) {
  auto session = database_.session();
  // Selects the newest reference of a scene that several tenants keep: SQLite takes the other
  // columns from the row with the maximum.
  Statement select = session.prepare(
      access.sees_all()
          ? "SELECT MAX(sequence) AS newest, scene, description, created_at FROM scene_tenants"
            " GROUP BY scene HAVING newest<? ORDER BY newest DESC LIMIT ?"
          : "SELECT sequence, scene, description, created_at FROM scene_tenants"
            " WHERE tenant=? AND sequence<? ORDER BY sequence DESC LIMIT ?");
  if (!access.sees_all()) {
    select.bind(access.tenant);
  }
  select.bind(before.value_or(std::numeric_limits<std::int64_t>::max())).bind(std::int64_t{limit});
  return select.rows([](const Statement& row) {
    return SceneRow{.sequence = row.integer(0),
                    .id = row.text(1),
                    .description = row.text(2),
                    .facts = {},
                    .created_at = row.real(3),
                    .files = {}};
  });
}

core::Result<SceneTable::Removal> SceneTable::plan_removal(std::string_view id,
                                                           const Access& access) {
  auto session = database_.session();
  Statement counted = session.prepare(
      "SELECT COUNT(*), COALESCE(SUM(tenant=?), 0) FROM scene_tenants WHERE scene=?");
  const auto references = references_to(id, access, counted);
  if (!references) {
    return references.error();
  }
  return Removal{.of_all = references->of_all,
                 .scene_goes = references->of_all || references->count == 1};
}

core::Result<std::vector<std::string>> SceneTable::remove_scene(std::string_view id,
                                                                const Access& access,
                                                                const Removal& removal) {
  std::vector<std::string> orphans;
  const Status done = database_.transact([&](Database::Session& session) -> Status {
    if (!removal.scene_goes) {
      Statement drop = session.prepare("DELETE FROM scene_tenants WHERE scene=? AND tenant=?");
      return drop.bind(id).bind(access.tenant).run();
    }
    Statement select = session.prepare(
        "SELECT DISTINCT f.asset FROM scene_files f WHERE f.scene = ?1"
        " AND NOT EXISTS (SELECT 1 FROM asset_tenants t WHERE t.asset = f.asset)"
        " AND NOT EXISTS (SELECT 1 FROM scene_files o WHERE o.asset = f.asset AND o.scene <> ?1)");
    auto assets = first_column(select.bind(id));
    if (!assets) {
      return assets.error();
    }
    orphans = *std::move(assets);
    for (const std::string& asset : orphans) {
      if (auto status = session.prepare("DELETE FROM assets WHERE id=?").bind(asset).run();
          !status) {
        return status;
      }
    }
    return session.prepare("DELETE FROM scenes WHERE id=?").bind(id).run();
  });
  if (!done) {
    return done.error();
  }
  return orphans;
}

}  // namespace server
