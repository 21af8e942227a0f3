/// Images and textures of a glTF file: selects the image of each texture, and decodes each image
/// once, in parallel.
#pragma once

#include <cstddef>
#include <exception>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/scene_io/gltf_source.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Returns whether the bytes of an image are in the document, or `resolve` has its file.
bool is_there(const GltfImage& image, const ResolveUri& resolve);

/// Returns the image of each texture, or -1: the KTX2 of KHR_texture_basisu or the WebP of
/// EXT_texture_webp if its file exists, else the plain source.
std::vector<int> choose_texture_images(const tinygltf::Model& model, const GltfTables& tables,
                                       const ResolveUri& resolve);

/// A material's reference to a texture.
struct TextureReference {
  int texture = -1;
  int uv_set = 0;
  const tinygltf::Value* transform = nullptr;  ///< KHR_texture_transform, or null
};

class GltfImages {
 public:
  /// Borrows all arguments; they must outlive it.
  GltfImages(const tinygltf::Model& model, GltfSource& source,
             const std::vector<int>& texture_images, const GltfLimits& limits,
             SceneDescription& scene)
      : model_(model),
        source_(source),
        texture_images_(texture_images),
        limits_(limits),
        scene_(scene) {}

  /// Registers the image for decode_all(); its entry in the scene is empty until then. uv_set is
  /// the file's number. Errors: kTooLarge, or those of decode_image if the header does not give the
  /// size, at "/images/N".
  Result<TextureDescription> texture(const TextureReference& reference);
  /// Decodes all images that texture() registered. Errors: those of decode_image, at "/images/N".
  Status decode_all();

  /// Adds a generated image and returns its index in the scene.
  int add(Image image);

 private:
  /// An image of the file that remains to be decoded.
  struct Noted {
    int image;           ///< of the file
    std::size_t to = 0;  ///< its index in the scene
    std::span<const std::byte> file;
    std::size_t bytes_max = 0;
    std::optional<Result<Image>> pixels = {};
    std::exception_ptr thrown = {};
  };

  Result<int> noted(int image);

  const tinygltf::Model& model_;
  GltfSource& source_;
  const std::vector<int>& texture_images_;
  GltfLimits limits_;
  SceneDescription& scene_;
  std::map<int, int> by_file_index_;
  std::vector<Noted> noted_;
};

}  // namespace core
