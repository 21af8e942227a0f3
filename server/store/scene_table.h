/// SceneTable: scenes, the tenants that keep them, and the assets that are part of each scene.
///
/// Equal scenes are one; each tenant that uploads it has its own reference and description.
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

/// A scene's files: maps uri in the glTF document to asset id. The document itself has the uri "".
using SceneFiles = std::map<std::string, std::string>;

struct SceneRow {
  std::int64_t sequence = 0;  ///< The newest has the highest; assigned by insert().
  std::string id;
  std::string description;  ///< JSON of GET /v1/scenes/{id}, generated when the tenant uploaded it.
  std::string facts;        ///< Facts for checking job requests; see scenes/scene_facts.h.
  double created_at = 0;
  SceneFiles files;
};

class SceneTable {
 public:
  /// database must outlive this.
  explicit SceneTable(Database& database) : database_(database) {}

  /// Inserts the scene if it is new, and a tenant's reference to it.
  core::Status insert_scene(const SceneRow& row, const Access& access);
  core::Status set_facts(std::string_view id, std::string_view facts);
  /// Returns empty if `access` sees no such scene.
  core::Result<std::optional<SceneRow>> find_scene(std::string_view id, const Access& access);
  /// Returns whether the tenant keeps it; if all is shared, whether any tenant does.
  core::Result<bool> keeps(std::string_view id, const Access& access);
  /// Returns scenes without facts and files, newest first.
  core::Result<std::vector<SceneRow>> list_scenes(const Access& access,
                                                  std::optional<std::int64_t> before, int limit);

  /// Effects of remove_scene().
  struct Removal {
    bool of_all =
        false;  ///< The references of all tenants, otherwise only the requesting tenant's.
    bool scene_goes = false;  ///< No tenant keeps it afterwards.
  };
  core::Result<Removal> plan_removal(std::string_view id, const Access& access);
  /// Returns the assets that came with the scene and have no references left: their files can be
  /// removed.
  core::Result<std::vector<std::string>> remove_scene(std::string_view id, const Access& access,
                                                      const Removal& removal);

 private:
  Database& database_;
};

}  // namespace server
