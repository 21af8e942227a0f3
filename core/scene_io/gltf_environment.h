/// EXT_lights_image_based: the light of a scene that comes from all around it.
///
/// A path tracer needs the radiance of every direction and nothing else: the first level of
/// `specularImages` is that, and becomes the environment. The blurred levels below it and
/// `irradianceCoefficients` are integrals of the same light over lobes, which the renderer takes
/// itself, with shadows; both are left alone.
/// Images of 8 and 16 bits are sRGB-encoded; with alpha, they are RGBD: colour divided by alpha.
/// Each face is what a viewer in the middle of the cube sees: the faces of OpenGL's cube maps,
/// flipped from left to right, as the extension asks.
/// Source: EXT_lights_image_based; OpenGL 4.6, table 8.19.
#pragma once

#include <memory>
#include <vector>

#include "core/base/result.h"
#include "core/image_io/image.h"
#include "core/scene_io/gltf_load.h"
#include "core/scene_io/gltf_source.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// The images that the environment of the scene is made of: none, or six.
/// Errors: those of nodes_of_scene().
Result<std::vector<int>> images_of_environment(const tinygltf::Model& model, int scene_index);

/// As Environment reads it: RGB floats, equirectangular, rotated and multiplied by the intensity;
/// null when the scene has none. Errors: those of decode_image at "/images/N"; kInvalidArgument for
/// a face that is not square; kTooLarge.
Result<std::shared_ptr<const Image>> read_environment(const tinygltf::Model& model,
                                                      GltfSource& source,
                                                      const GltfOptions& options);

}  // namespace core
