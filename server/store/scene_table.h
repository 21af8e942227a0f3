/// SceneTable: which scenes and assets there are, and which asset is part of which scene.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/store/database.h"

namespace server {

/// A scene's files: uri in the glTF document to asset id. The document itself has the uri "".
using SceneFiles = std::map<std::string, std::string>;

struct SceneRow {
  std::int64_t sequence = 0;  ///< Newest has the highest; given by insert().
  std::string id;
  std::string description;  ///< JSON of GET /v1/scenes/{id}, made when the scene was uploaded.
  std::string facts;        ///< What a job request is checked against; see scenes/scene_facts.h.
  double created_at = 0;
  SceneFiles files;
};

struct AssetRow {
  std::string id;
  std::uint64_t bytes = 0;
  bool uploaded = false;  ///< By itself, through /v1/assets; such an asset stays when its last scene goes.
  double created_at = 0;
  std::string owner = {};  ///< Id of the key that brings it; empty: no stored key.
};

class SceneTable {
 public:
  /// database must outlive this.
  explicit SceneTable(Database& database) : database_(database) {}

  /// One that is known keeps its owner.
  core::Status insert_asset(const AssetRow& row);
  /// Errors: kConflict while a scene has it.
  core::Status remove_asset(std::string_view id);
  core::Result<bool> asset_in_a_scene(std::string_view id);
  core::Result<bool> knows_asset(std::string_view id);

  core::Status insert_scene(const SceneRow& row);
  core::Result<std::optional<SceneRow>> find_scene(std::string_view id);
  /// Newest first, without files.
  core::Result<std::vector<SceneRow>> list_scenes(std::optional<std::int64_t> before, int limit);
  /// Returns the assets that came with the scene, are in no other one, and were not uploaded by
  /// themselves: their files may go.
  core::Result<std::vector<std::string>> remove_scene(std::string_view id);

 private:
  Database& database_;
};

}  // namespace server
