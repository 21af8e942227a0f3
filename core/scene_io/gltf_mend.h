/// Mends what rows of the schemas cannot express: members that contradict each other or their
/// object.
#pragma once

#include "core/base/result.h"
#include "core/scene_io/gltf_json.h"
#include "core/scene_io/gltf_repairs.h"
#include "core/scene_io/gltf_tables.h"

namespace core {

/// Mends nodes, cameras, materials, spots, animations and accessors of vertices so that
/// parse_model() accepts them; cameras and animations without a meaning are left out. Strict:
/// kInvalidArgument for what later steps would accept. Pre: check_schemas() accepted the document.
Status mend_document(GltfJson& root, GltfTables& tables, GltfRepairs& repairs);

/// Takes the matrix of every node whose translation, rotation or scale is animated apart. Pre:
/// read_pointers() was called. Errors: kInvalidArgument at the matrix if it shears, and so is not a
/// product of the three; strict: at every such matrix, which glTF 2.0 (3.5.3) forbids.
Status take_animated_matrices_apart(GltfJson& root, GltfRepairs& repairs);

}  // namespace core
