#include "core/scene_io/gltf_meshopt.h"

#include <meshoptimizer.h>

namespace core {

Result<Bytes> decode_meshopt(const GltfMeshopt& meshopt, std::span<const std::byte> compressed,
                             std::uint64_t view_bytes, const std::string& where) {
  Bytes bytes(view_bytes);
  const auto* input = reinterpret_cast<const unsigned char*>(compressed.data());
  int failure = 0;
  switch (meshopt.mode) {
    case MeshoptMode::kAttributes:
      failure = meshopt_decodeVertexBuffer(bytes.data(), meshopt.count, meshopt.stride, input,
                                           compressed.size());
      break;
    case MeshoptMode::kTriangles:
      failure = meshopt_decodeIndexBuffer(bytes.data(), meshopt.count, meshopt.stride, input,
                                          compressed.size());
      break;
    case MeshoptMode::kIndices:
      failure = meshopt_decodeIndexSequence(bytes.data(), meshopt.count, meshopt.stride, input,
                                            compressed.size());
      break;
  }
  if (failure != 0) {
    return Error{ErrorCode::kInvalidArgument,
                 "the meshopt data is malformed (code " + std::to_string(failure) + ")", where};
  }
  switch (meshopt.filter) {
    case MeshoptFilter::kNone:
      break;
    case MeshoptFilter::kOctahedral:
      meshopt_decodeFilterOct(bytes.data(), meshopt.count, meshopt.stride);
      break;
    case MeshoptFilter::kQuaternion:
      meshopt_decodeFilterQuat(bytes.data(), meshopt.count, meshopt.stride);
      break;
    case MeshoptFilter::kExponential:
      meshopt_decodeFilterExp(bytes.data(), meshopt.count, meshopt.stride);
      break;
  }
  return bytes;
}

}  // namespace core
