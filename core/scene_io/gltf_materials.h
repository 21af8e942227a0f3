/// glTF materials with all KHR_materials extensions to MaterialDescription.
#pragma once

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/scene_io/gltf_images.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Fills scene.materials, one for each of the file's, and scene.has_emissive_strength. Of materials
/// that nothing uses and that cannot be read, only the name is kept.
///
/// KHR_materials_pbrSpecularGlossiness becomes a dielectric of ior 0 (KHR_materials_ior: F0 is the
/// specular colour alone), without loss; a glossiness texture becomes a roughness texture.
Status read_materials(const tinygltf::Model& model, const GltfTables& tables, GltfImages& images,
                      SceneDescription& scene);

}  // namespace core
