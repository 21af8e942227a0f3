/// EXT_lights_image_based: the environment of a scene.
///
/// A path tracer needs only the radiance of every direction: the first level of `specularImages`,
/// which becomes the environment. The blurred levels and `irradianceCoefficients` are integrals of
/// the same light over lobes, which the renderer computes itself, with shadows; both are ignored.
/// Images of 8 and 16 bits are sRGB-encoded; with alpha they are RGBD: colour divided by alpha.
/// Each face shows the view from the centre of the cube: the faces of OpenGL's cube maps, flipped
/// horizontally, as the extension specifies. Source: EXT_lights_image_based; OpenGL 4.6, table
/// 8.19.
#pragma once

#include <memory>
#include <vector>

#include "core/base/result.h"
#include "core/image_io/image.h"
#include "core/scene_io/gltf_load.h"
#include "core/scene_io/gltf_source.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Returns the images of the scene's environment: none, or six. Errors: as nodes_of_scene().
Result<std::vector<int>> images_of_environment(const tinygltf::Model& model, int scene_index);

/// Returns the environment as Environment reads it: RGB floats, equirectangular, rotated and
/// multiplied by the intensity; null if the scene has none. Errors: those of decode_image at
/// "/images/N"; kInvalidArgument for a face that is not square; kTooLarge.
Result<std::shared_ptr<const Image>> read_environment(const tinygltf::Model& model,
                                                      GltfSource& source,
                                                      const GltfOptions& options,
                                                      std::vector<Warning>& warnings);

}  // namespace core
