/// SceneService: adds, describes, loads and shares scenes, by id or built-in name.
///
/// The id of a scene is the sha256 of its content: of its single file, or of the list of its files.
/// Loaded scenes are cached up to a number of bytes, by (id, time, variant).
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <shared_mutex>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "api/requests.h"
#include "core/aovs/first_surfaces.h"
#include "core/aovs/motion.h"
#include "core/base/file_names.h"
#include "core/base/mutex.h"
#include "core/base/result.h"
#include "core/base/zip_reader.h"
#include "core/lights/environment.h"
#include "core/scene/scene.h"
#include "core/scene/scene_moment.h"
#include "core/scene_io/convert.h"
#include "core/scene_io/gltf_load.h"
#include "core/scene_io/split_gltf.h"
#include "core/settings/settings.h"
#include "server/access.h"
#include "server/observe/memory_gate.h"
#include "server/observe/turns.h"
#include "server/scenes/single_flight_cache.h"
#include "server/store/assets.h"
#include "server/store/scene_table.h"
#include "server/store/storage_quota.h"

namespace server {

struct SceneServiceOptions {
  std::uint64_t cache_bytes = std::uint64_t{4} << 30U;
  std::uint64_t motion_cache_bytes = std::uint64_t{512} << 20U;
  std::uint64_t environment_cache_bytes = std::uint64_t{512} << 20U;
  std::uint64_t tree_cache_bytes = std::uint64_t{512} << 20U;
  int threads = 1;       ///< For acceleration structures.
  std::string isa = {};  ///< Instruction set for Embree; empty: not limited.
  core::ZipLimits zip = {};
  core::Converters converters = {};
  std::chrono::seconds convert_time{60};
};

/// Origin of a scene.
struct SceneOrigin {
  Access access = {};                   ///< The uploader.
  std::string name = {};                ///< Empty: the name inside the file.
  bool is_strict = false;               ///< As in core::GltfOptions.
  std::stop_token stop = {};            ///< Ends the checks with kCancelled.
  std::vector<std::string> notes = {};  ///< Of a converter: warnings of the scene.
};

/// Objects added to a scene for a job.
struct SceneStand {
  core::GroundSettings ground;
  core::Vec3 view_direction = {0, 0, -1};  ///< As for add_ground().
};

struct LoadTerms {
  /// Whether the caller already holds memory for loading (an admitted job) or must reserve it.
  enum class Admission : std::uint8_t { kNeeded, kGiven };
  Admission admission = Admission::kNeeded;
  std::stop_token stop = {};  ///< Ends the loading with kCancelled.
};

class SceneService {
 public:
  /// All arguments except the options must outlive this.
  SceneService(Assets& assets, SceneTable& table, StorageQuota& quota, MemoryGate& memory,
               SceneServiceOptions options);

  struct Added {
    std::string id;
    std::string description;  ///< JSON
    bool known = false;
    /// Names of files that the scene needs besides, as gltf_files() gives them; then nothing was
    /// added.
    std::vector<std::string> missing = {};
    std::vector<std::string> outside = {};  ///< those of them that lead out of the upload
    std::vector<std::string> near = {};     ///< FileNames::near() of each
  };
  /// A file, and the lease of its memory.
  struct Upload {
    Upload(core::Bytes file, MemoryGate::Lease held = {})
        : content(std::move(file)), lease(std::move(held)) {}
    core::Bytes content;
    MemoryGate::Lease lease;
  };
  /// Adds a GLB, a glTF document, or a zip archive with one of them. Loads the scene to check it.
  /// Errors: of load_gltf() and Scene::build(), kNoSpace, kOverQuota, kTooLarge;
  /// kUnavailable when memory is short.
  core::Result<Added> add_file(Upload file, const SceneOrigin& origin = {});
  core::Result<Added> add_zip(Upload archive, const SceneOrigin& origin = {});
  /// A file that is uploaded with a scene, and its name; a section of memory that the caller holds.
  struct SideFile {
    std::string name;
    std::string_view content;
  };
  /// Adds a GLB or a glTF document and the files that it refers to. A file is found by its name as
  /// in an archive, or by the last part of the name, since many programs send no more of it.
  core::Result<Added> add_with_sides(Upload document, const std::vector<SideFile>& sides,
                                     const SceneOrigin& origin = {});
  /// Replaces a file of another format by a GLB, and adds what the converter says to origin.notes.
  /// So too a zip that has no glTF, but such a file. extension: in lower case; empty: unknown.
  /// Returns false, and changes nothing, for files that the functions above read. Errors: of
  /// convert_to_glb(); kTooLarge, kUnavailable for memory.
  core::Result<bool> convert(Upload& file, std::string_view extension,
                             const std::vector<SideFile>& sides, SceneOrigin& origin);
  const core::Converters& converters() const { return options_.converters; }
  /// Errors: also kInvalidArgument at "/gltf" or "/files/..." for an unknown asset.
  core::Result<Added> add_from_assets(const api::SceneFromAssets& request,
                                      const SceneOrigin& origin = {});

  /// What a camera sees of a scene that is not added.
  struct VisibleSurfaces {
    std::vector<core::FirstSurface> surfaces;
    std::vector<core::Rgb> base_colors;  ///< factors, by material
  };
  /// Trees of meshes are cached by content. origin: its tenant waits for a turn as for an upload.
  /// Errors: as add_file(); of the camera.
  core::Result<VisibleSurfaces> first_surfaces(const core::SplitGltf& gltf,
                                               const core::CameraSettings& camera,
                                               const core::FilmSettings& film,
                                               const SceneOrigin& origin);

  /// Returns the JSON of a stored or built-in scene. Errors: kNotFound, also for a scene that
  /// `access` does not see; built-in scenes are visible to all.
  core::Result<std::string> description(const std::string& id, const Access& access);
  /// Returns the facts against which job requests are checked. Errors: the same.
  core::Result<core::SceneSummary> facts(const std::string& id, const Access& access);
  core::Result<std::vector<SceneRow>> list(const Access& access, std::optional<std::int64_t> before,
                                           int limit);
  /// Drops the tenant's reference; for the operator, who has none, drops all. in_use: whether jobs
  /// need it, of a tenant or (empty) of all. Errors: kNotFound (built-in scenes too); kConflict
  /// while a job that would lose it needs it.
  core::Status remove(const std::string& id, const Access& access, const Assets::InUse& in_use);
  /// Returns the files of a stored scene. Errors: kNotFound.
  core::Result<SceneFiles> files(const std::string& id);
  /// Returns a built-in scene as a GLB; null for any other name.
  core::SharedBytes builtin_glb(std::string_view name);

  /// Errors: kNotFound when the scene is gone; of load_gltf() and Scene::build(); kUnavailable when
  /// memory is short.
  core::Result<std::shared_ptr<const core::Scene>> load(const std::string& id,
                                                        const core::SceneMoment& moment,
                                                        const LoadTerms& terms = {},
                                                        const SceneStand& stand = {});

  /// Returns the scene at the second time of motion vectors. moment: that of api::later_moment().
  /// Errors: of load().
  core::Result<std::shared_ptr<const core::MotionTarget>> later(const std::string& id,
                                                                const core::SceneMoment& moment,
                                                                const LoadTerms& terms = {});

  /// Never null: settings alone give a constant environment. Errors: kInvalidArgument at
  /// "/environment/asset" for an unknown asset or one that is not an image; kUnavailable as for
  /// load().
  core::Result<std::shared_ptr<const core::Environment>> environment(
      const std::optional<std::string>& asset, const core::EnvironmentSettings& settings,
      const LoadTerms& terms = {});
  /// Returns what the user should know about the texels of an environment that environment() has
  /// loaded; empty if there is nothing.
  std::string environment_warning(const std::string& asset);
  /// The same errors, from the header of the file alone; assets that `access` does not see count as
  /// unknown.
  core::Status check_environment(const std::string& asset, const Access& access);

  /// Memory of a loaded scene or environment, and its name: jobs with the same name share it. Bytes
  /// are 0 when unknown.
  struct Memory {
    std::string name;
    std::uint64_t bytes = 0;
    std::uint64_t load_bytes = 0;  ///< Besides them, while it is loaded.
  };
  Memory memory_of_scene(const std::string& id, const core::SceneMoment& moment,
                         const SceneStand& stand = {});
  Memory memory_of_later(const std::string& id, const core::SceneMoment& moment);
  Memory memory_of_environment(const std::string& asset, const core::EnvironmentSettings& settings);

  /// Held shared from finding a scene or asset until a record names it; held exclusively from
  /// searching for such records until deletion. Locked before all other mutexes here.
  std::shared_mutex& names_mutex() { return names_mutex_; }

  std::uint64_t cached_bytes() const { return scenes_.bytes(); }

 private:
  struct Document {
    core::SharedBytes bytes;
    std::map<std::string, core::SharedBytes> files;
  };
  /// The files that come with a document. read: only of names that it has; takes memory.
  struct FindFile {
    std::function<bool(std::string_view name)> has;
    std::function<core::Result<core::SharedBytes>(std::string_view name, MemoryGate::Lease&)> read;
    const core::FileNames& names;
    std::function<bool(std::string_view name)> is_outside = leads_out;

    static bool leads_out(std::string_view name) {
      return !core::plain_name(core::with_slashes(name));
    }
  };
  static std::string cache_key(const std::string& id, const core::SceneMoment& moment,
                               const SceneStand& stand);
  struct EnvironmentSize {
    std::uint64_t bytes = 0;
    std::uint64_t load_bytes = 0;
  };
  core::Result<EnvironmentSize> size_of_environment(const std::string& asset);
  core::Result<Document> document_of(const std::string& id);
  /// A stored scene, and the lease of the memory in which it is loaded.
  struct Source {
    MemoryGate::Lease lease;
    Document document;
  };
  core::Result<Source> open(const std::string& id, const Memory& needed, const LoadTerms& terms);
  core::Result<core::SceneDescription> describe(const Document& document, core::GltfOptions options,
                                                const std::stop_token& stop);
  core::Result<std::shared_ptr<const core::Scene>> build(const Document& document,
                                                         const core::GltfOptions& options,
                                                         const std::stop_token& stop,
                                                         const SceneStand& stand = {});
  core::Result<Added> add_with_files(core::SharedBytes main, const FindFile& find,
                                     MemoryGate::Lease lease, const SceneOrigin& origin);
  core::Result<Added> add_document(Document document, MemoryGate::Lease lease,
                                   const SceneOrigin& origin);
  /// Returns the scene with its memory, for the cache.
  SingleFlightCache<core::Scene>::Made held(const std::string& key,
                                            std::shared_ptr<const core::Scene> scene);
  core::Status keep(const Document& document, const SceneRow& row, const Access& access);
  core::Result<Added> known_scene(const std::string& id, const Access& access);

  Assets& assets_;
  SceneTable& table_;
  StorageQuota& quota_;
  MemoryGate& memory_;
  const SceneServiceOptions options_;
  SingleFlightCache<core::Scene> scenes_;
  SingleFlightCache<core::MotionTarget> later_;
  SingleFlightCache<core::Environment> environments_;
  SingleFlightCache<core::MeshTree> trees_;
  Turns uploads_;  ///< For concurrent checks, which hold memory.
  std::shared_mutex names_mutex_;
  core::Mutex builtin_mutex_;
  std::map<std::string, core::SharedBytes, std::less<>> builtin_ GUARDED_BY(builtin_mutex_);
  std::map<std::string, std::uint64_t> builtin_bytes_
      GUARDED_BY(builtin_mutex_);  ///< Sizes of built-in scenes loaded so far.
  core::Mutex sizes_mutex_;
  std::map<std::string, EnvironmentSize> environment_sizes_
      GUARDED_BY(sizes_mutex_);  ///< Sizes of environments read so far.
  std::map<std::string, std::string> environment_warnings_ GUARDED_BY(sizes_mutex_);
};

}  // namespace server
