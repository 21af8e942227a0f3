/// The parts of a glTF document that refer to bytes: buffers, views, accessors, images, light
/// profiles. Filled by check_gltf(), which ensures with check_tables() that every view lies in its
/// buffer and every accessor in its view.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "core/base/result.h"
#include "core/scene_io/gltf_container.h"
#include "core/scene_io/gltf_repairs.h"

namespace core {

/// Returns "/nodes/3".
inline std::string pointer_of(const char* collection, std::size_t i) {
  return std::string("/") + collection + "/" + std::to_string(i);
}

struct GltfBuffer {
  std::uint64_t bytes = 0;
  std::optional<std::string> uri;    ///< none: the binary chunk of the GLB, or a meshopt fallback
  bool is_meshopt_fallback = false;  ///< has no content; its views are created by decoding
};

enum class MeshoptMode : std::uint8_t { kAttributes, kTriangles, kIndices };
enum class MeshoptFilter : std::uint8_t { kNone, kOctahedral, kQuaternion, kExponential };

/// EXT_meshopt_compression of a view.
struct GltfMeshopt {
  int buffer = -1;
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::uint64_t stride = 0;
  std::uint64_t count = 0;
  MeshoptMode mode = MeshoptMode::kAttributes;
  MeshoptFilter filter = MeshoptFilter::kNone;
};

struct GltfView {
  int buffer = -1;
  std::uint64_t offset = 0;
  std::uint64_t bytes = 0;
  std::uint64_t stride = 0;  ///< 0: tightly packed
  std::optional<GltfMeshopt> meshopt;
};

/// The values are those of glTF.
enum class ComponentType : std::uint16_t {
  kI8 = 5120,
  kU8 = 5121,
  kI16 = 5122,
  kU16 = 5123,
  kU32 = 5125,
  kF32 = 5126
};
constexpr std::uint64_t component_bytes(ComponentType type) noexcept {
  return type == ComponentType::kI8 || type == ComponentType::kU8     ? 1
         : type == ComponentType::kI16 || type == ComponentType::kU16 ? 2
                                                                      : 4;
}

/// Rows and columns of an element; vectors and scalars have one column.
struct ElementShape {
  int rows = 1;
  int columns = 1;
  constexpr int values() const noexcept { return rows * columns; }
};

/// Returns the bytes of one element: matrix columns start at multiples of four.
constexpr std::uint64_t element_bytes(ComponentType type, ElementShape shape) noexcept {
  const std::uint64_t column = component_bytes(type) * static_cast<std::uint64_t>(shape.rows);
  const std::uint64_t padded = shape.columns > 1 ? (column + 3) / 4 * 4 : column;
  return padded * static_cast<std::uint64_t>(shape.columns);
}

struct GltfSparse {
  std::uint64_t count = 0;
  int indices_view = -1;
  std::uint64_t indices_offset = 0;
  ComponentType indices_type = ComponentType::kU16;
  int values_view = -1;
  std::uint64_t values_offset = 0;
};

struct GltfAccessor {
  int view = -1;  ///< -1: zeros, or filled by Draco
  std::uint64_t offset = 0;
  std::uint64_t count = 0;
  ComponentType component = ComponentType::kF32;
  ElementShape shape;
  bool normalized = false;
  std::optional<GltfSparse> sparse;
};

struct GltfImage {
  std::string name;
  std::string media_type;  ///< as the file says; the bytes decide
  std::optional<std::string> uri;
  int view = -1;
};

/// A light profile of EXT_lights_ies.
struct GltfProfile {
  std::optional<std::string> uri;
  int view = -1;
};

/// A channel of KHR_animation_pointer that targets a supported member of the document.
struct GltfPointer {
  std::size_t animation = 0;
  std::size_t channel = 0;
  int input = -1;   ///< accessor of the times
  int output = -1;  ///< accessor of the values
  std::string interpolation;
  std::string path;       ///< JSON pointer
  std::size_t width = 1;  ///< of a value; 0: as in the accessor (morph target weights)
  bool is_boolean = false;
  bool is_array = false;
  bool is_rotation = false;
  float min = 0;
  float max = 0;
};

/// An element of one of the document's arrays.
struct GltfPart {
  std::string array;  ///< as in SchemaMember::refers_to: "accessors", "lights", ...
  std::size_t index = 0;
  friend bool operator<(const GltfPart& a, const GltfPart& b) {
    return std::tie(a.array, a.index) < std::tie(b.array, b.index);
  }
};

struct GltfTables {
  /// Parts that scenes and animations refer to, directly or not. Strict reading: all.
  std::set<GltfPart> used;
  /// Parts with faults, which are not read; an error where one is needed.
  std::map<GltfPart, Error> left_out;
  std::vector<GltfBuffer> buffers;
  std::vector<GltfView> views;
  std::vector<GltfAccessor> accessors;
  std::vector<GltfImage> images;
  std::vector<GltfProfile> profiles;
  std::vector<GltfPointer> pointers;

  bool uses(const char* array, std::size_t index) const { return used.contains({array, index}); }
  /// Returns the fault of a part that was left out, or null.
  const Error* fault_of(const char* array, int index) const;
};

/// Notes that a part is left out because of its fault.
void leave_out(GltfTables& tables, const GltfPart& part, const Error& fault, GltfRepairs& repairs);

/// Returns how many bytes of a buffer its accessors, and views without accessors, reach.
std::uint64_t needed_bytes(const GltfTables& tables, std::size_t buffer);

/// Checks all ranges in the tables: views in buffers, accessors and sparse parts in views. Parts
/// with faults are left out, to be refused where they are needed. Pre: indices between the tables
/// are valid. Errors: kInvalidArgument with a JSON pointer, for buffers that are used; strict: for
/// every fault.
Status check_tables(GltfTables& tables, const GltfContainer& container, GltfRepairs& repairs);

}  // namespace core
