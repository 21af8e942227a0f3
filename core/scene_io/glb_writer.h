/// Writes GLB files: whole scene descriptions, or piece by piece for features that these lack.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "core/description/scene_description.h"
#include "core/scene_io/gltf_load.h"

namespace core {

/// Builds a glTF document from JSON text. The text is ours, so malformed JSON aborts the process.
class GlbWriter {
 public:
  GlbWriter();
  ~GlbWriter();
  GlbWriter(const GlbWriter&) = delete;
  GlbWriter& operator=(const GlbWriter&) = delete;

  /// Appends an object to a top-level array ("nodes", "materials", ...) and returns its index.
  int add(std::string_view collection, std::string_view json);
  /// Sets a member of the document, e.g. "extensionsRequired" or "scene".
  void set(std::string_view member, std::string_view json);
  /// Adds an extension to extensionsUsed, once.
  void use_extension(std::string_view name);

  /// Adds a view of a copy of the bytes, aligned to 4, and returns its index. `more` is merged into
  /// the view's JSON.
  int add_view(std::span<const std::byte> bytes, std::string_view more = "{}");
  /// Adds a view and an accessor of all its elements. component_type and type are glTF's names;
  /// `more` is merged into the accessor's JSON.
  int add_accessor(std::span<const std::byte> bytes, int component_type, std::string_view type,
                   std::size_t count, std::string_view more = "{}");

  /// Returns the file. By default "scenes" has one scene with all root nodes.
  Bytes finish();
  /// The same document as JSON text with one buffer, `bin_uri`, and that buffer.
  struct Separate {
    std::string json;
    Bytes bin;
  };
  Separate finish_separate(std::string_view bin_uri);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Writes everything in `scene` that glTF can express, including materials with their KHR
/// extensions. 8-bit images of 1, 3 or 4 channels become PNGs. Instances become nodes; nodes of
/// cameras and lights have their names. Pre: the scene is valid, its images have 8 bits, and no
/// light has a profile.
Bytes write_glb(const SceneDescription& scene);

}  // namespace core
