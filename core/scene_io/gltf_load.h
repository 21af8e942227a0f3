/// Reads glTF 2.0 (GLB or JSON with side files) into a SceneDescription.
///
/// Never accesses the file system: side files come from `resolve`. Every count and size is checked
/// before memory is allocated. Error::where is a JSON pointer into the glTF document
/// ("/meshes/0/primitives/1/indices"), or empty for the container.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/scene/scene_moment.h"

namespace core {

using Bytes = std::vector<std::byte>;
using SharedBytes = std::shared_ptr<const Bytes>;

struct GltfLimits {
  std::size_t json_bytes_max = std::size_t{256} << 20;
  int json_depth_max = 64;
  std::size_t triangles_max = 200'000'000;
  std::size_t instances_max = 10'000'000;
  std::size_t decoded_bytes_max = std::size_t{8} << 30;  ///< geometry and images together
  std::size_t paged_bytes_max = std::size_t{8} << 30;    ///< images that lie in files, instead
  int image_side_max = 16384;
  /// Called before reading or building allocates this many more bytes, including JSON; an error
  /// ends the reading. Null: no check.
  std::function<Status(std::uint64_t bytes)> admit = {};
};

struct GltfOptions : SceneMoment {
  int scene_index = -1;  ///< -1: the file's default scene
  /// Refuses every fault that would otherwise be mended with a warning (gltf_repairs.h).
  bool is_strict = false;
  GltfLimits limits = {};
  /// If the scene is one of several times of an open shutter: PlayTime::opening_seconds.
  std::optional<double> opening_seconds = {};
};

/// For GltfLimits::admit: ends the reading with kCancelled when a stop is requested.
inline std::function<Status(std::uint64_t)> until_stopped(std::stop_token stop) {
  return [stop = std::move(stop)](std::uint64_t /*bytes*/) {
    return stop.stop_requested()
               ? Status(Error{ErrorCode::kCancelled, "stopped while reading the scene", ""})
               : ok_status();
  };
}

/// Looks up a side file by the uri in the glTF (percent-decoded); empty if it was not uploaded.
using ResolveUri = std::function<SharedBytes(std::string_view uri)>;

/// Errors: kInvalidArgument (broken or unsupported content, with its location), kTooLarge,
/// kMissingFiles (the message lists every uri that `resolve` does not have).
Result<SceneDescription> load_gltf(std::span<const std::byte> file, const ResolveUri& resolve,
                                   const GltfOptions& options);

/// Whether there is a file with that name, a percent-decoded uri.
using HasFile = std::function<bool(std::string_view name)>;

/// Returns the names of the files that load_gltf() reads of those that `has` has, and of those that
/// it needs besides, in the order of the document, each once: of buffers, of images of textures and
/// of the environment, and of light profiles. Errors: as load_gltf().
Result<std::vector<std::string>> gltf_files(std::span<const std::byte> file, const HasFile& has,
                                            const GltfLimits& limits = {});

}  // namespace core
