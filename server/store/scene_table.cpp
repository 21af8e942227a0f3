#include "server/store/scene_table.h"

namespace server {

using core::Status;

Status SceneTable::insert_asset(const AssetRow& row) {
  return database_.transact([&](Database::Session& session) -> Status {
    Statement insert = session.prepare(
        "INSERT INTO assets(id, bytes, uploaded, created_at, owner) VALUES(?,?,?,?,?)"
        " ON CONFLICT(id) DO UPDATE SET uploaded = max(uploaded, excluded.uploaded)");
    insert.bind(row.id).bind(static_cast<std::int64_t>(row.bytes)).bind(std::int64_t{row.uploaded ? 1 : 0});
    return insert.bind(row.created_at).bind(row.owner).run();
  });
}

Status SceneTable::remove_asset(std::string_view id) {
  return database_.transact([&](Database::Session& session) -> Status {
    Statement used = session.prepare("SELECT 1 FROM scene_files WHERE asset=? LIMIT 1");
    if (used.bind(id).step()) {
      return core::Error{core::ErrorCode::kConflict, "a scene uses the asset", ""};
    }
    if (auto status = used.status(); !status) {
      return status;
    }
    return session.prepare("DELETE FROM assets WHERE id=?").bind(id).run();
  });
}

core::Result<bool> SceneTable::asset_in_a_scene(std::string_view id) {
  auto session = database_.session();
  Statement select = session.prepare("SELECT 1 FROM scene_files WHERE asset=? LIMIT 1");
  const bool found = select.bind(id).step();
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  return found;
}

core::Result<bool> SceneTable::knows_asset(std::string_view id) {
  auto session = database_.session();
  Statement select = session.prepare("SELECT 1 FROM assets WHERE id=?");
  const bool found = select.bind(id).step();
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  return found;
}

Status SceneTable::insert_scene(const SceneRow& row) {
  return database_.transact([&row](Database::Session& session) -> Status {
    Statement insert = session.prepare(
        "INSERT INTO scenes(id, description, facts, created_at) VALUES(?,?,?,?)"
        " ON CONFLICT(id) DO NOTHING");
    insert.bind(row.id).bind(row.description).bind(row.facts).bind(row.created_at);
    if (auto status = insert.run(); !status) {
      return status;
    }
    for (const auto& [uri, asset] : row.files) {
      Statement file = session.prepare(
          "INSERT INTO scene_files(scene, uri, asset) VALUES(?,?,?) ON CONFLICT DO NOTHING");
      if (auto status = file.bind(row.id).bind(uri).bind(asset).run(); !status) {
        return status;
      }
    }
    return core::ok_status();
  });
}

core::Result<std::optional<SceneRow>> SceneTable::find_scene(std::string_view id) {
  auto session = database_.session();
  std::optional<SceneRow> row;
  Statement select =
      session.prepare("SELECT sequence, id, description, facts, created_at FROM scenes WHERE id=?");
  if (select.bind(id).step()) {
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

core::Result<std::vector<SceneRow>> SceneTable::list_scenes(std::optional<std::int64_t> before,
                                                            int limit) {
  auto session = database_.session();
  Statement select = session.prepare(
      before ? "SELECT sequence, id, description, facts, created_at FROM scenes WHERE sequence<?"
               " ORDER BY sequence DESC LIMIT ?"
             : "SELECT sequence, id, description, facts, created_at FROM scenes"
               " ORDER BY sequence DESC LIMIT ?");
  if (before) {
    select.bind(*before);
  }
  select.bind(std::int64_t{limit});
  std::vector<SceneRow> rows;
  while (select.step()) {
    rows.push_back(SceneRow{.sequence = select.integer(0),
                            .id = select.text(1),
                            .description = select.text(2),
                            .facts = select.text(3),
                            .created_at = select.real(4),
                            .files = {}});
  }
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  return rows;
}

core::Result<std::vector<std::string>> SceneTable::remove_scene(std::string_view id) {
  std::vector<std::string> orphans;
  const Status done = database_.transact([&](Database::Session& session) -> Status {
    Statement select = session.prepare(
        "SELECT DISTINCT f.asset FROM scene_files f JOIN assets a ON a.id = f.asset"
        " WHERE f.scene = ?1 AND a.uploaded = 0"
        " AND NOT EXISTS (SELECT 1 FROM scene_files o WHERE o.asset = f.asset AND o.scene <> ?1)");
    select.bind(id);
    while (select.step()) {
      orphans.push_back(select.text(0));
    }
    if (auto status = select.status(); !status) {
      return status;
    }
    for (const std::string& asset : orphans) {
      if (auto status = session.prepare("DELETE FROM assets WHERE id=?").bind(asset).run(); !status) {
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
