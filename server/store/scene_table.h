/// SceneTable: which scenes there are, who keeps them, and which asset is part of which scene.
///
/// Equal scenes are one; each tenant that uploads it has a reference with a description of its own.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/access.h"
#include "server/store/database.h"

namespace server {

/// A scene's files: uri in the glTF document to asset id. The document itself has the uri "".
using SceneFiles = std::map<std::string, std::string>;

struct SceneRow {
  std::int64_t sequence = 0;  ///< Newest has the highest; given by insert().
  std::string id;
  std::string description;  ///< JSON of GET /v1/scenes/{id}, made when the tenant uploaded it.
  std::string facts;        ///< What a job request is checked against; see scenes/scene_facts.h.
  double created_at = 0;
  SceneFiles files;
};

class SceneTable {
 public:
  /// database must outlive this.
  explicit SceneTable(Database& database) : database_(database) {}

  /// The scene, if it is new, and the reference of a tenant to it.
  core::Status insert_scene(const SceneRow& row, const Access& access);
  /// Empty: there is none that `access` sees.
  core::Result<std::optional<SceneRow>> find_scene(std::string_view id, const Access& access);
  /// Does the tenant keep it? Where all is shared: does anybody?
  core::Result<bool> keeps(std::string_view id, const Access& access);
  /// Newest first, without facts and files.
  core::Result<std::vector<SceneRow>> list_scenes(const Access& access,
                                                  std::optional<std::int64_t> before, int limit);

  /// What remove_scene() would drop.
  struct Removal {
    bool of_all = false;      ///< The references of all tenants, else that of the one who asks.
    bool scene_goes = false;  ///< Nobody keeps it then.
  };
  core::Result<Removal> plan_removal(std::string_view id, const Access& access);
  /// Returns the assets that came with the scene and that nothing keeps any more: their files may
  /// go.
  core::Result<std::vector<std::string>> remove_scene(std::string_view id, const Access& access,
                                                      const Removal& removal);

 private:
  Database& database_;
};

}  // namespace server
