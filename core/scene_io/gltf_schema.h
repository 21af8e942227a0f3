/// Schemas of glTF objects as data: one row per member.
///
/// The rows come from the JSON schemas of glTF 2.0 and of the supported extensions. Members without
/// a row are ignored, as the specification requires. Rows of materials' extensions also say which
/// value of MaterialDescription they are, so that reader and writer need no further list.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>

namespace core {

struct MaterialDescription;
struct Rgb;
struct TextureDescription;

enum class JsonKind : std::uint8_t {
  kInteger,
  kNumber,
  kString,
  kBoolean,
  kObject,       ///< of schema `child`
  kIntegers,     ///< array; range and refers_to apply to each element
  kNumbers,      ///< array
  kStrings,      ///< array
  kObjects,      ///< array of objects of schema `child`
  kIntegerMap,   ///< object with integer members only
  kIntegerMaps,  ///< array of integer maps
  kIntegerRows,  ///< array of arrays of `row_count`; range and refers_to apply to each integer
  kNumberRows    ///< array of arrays of `row_count`
};

/// What is done about a value that does not fit its row (core/scene_io/gltf_repairs.h).
enum class Repair : std::uint8_t {
  kRefuse,     ///< an error: what is meant would have to be guessed
  kLeaveOut,   ///< an optional member counts as absent
  kClamp,      ///< numbers outside the range count as its nearest bound; others as kLeaveOut
  kNormalize,  ///< a quaternion of another length is normalised; others are errors
  kKeep        ///< numbers above or below the range, but not below 0, are used as they are
};

struct SchemaMember {
  std::string_view name;
  JsonKind kind = JsonKind::kNumber;
  bool required = false;
  double min = -std::numeric_limits<double>::infinity();
  double max = std::numeric_limits<double>::infinity();
  /// Top-level array that an integer indexes: "accessors"; or "lights", "light profiles",
  /// "image-based lights", "variants".
  std::string_view refers_to = {};
  std::size_t count_min = 0;  ///< of an array or a map
  std::size_t count_max = std::numeric_limits<std::size_t>::max();
  std::size_t row_count = 0;
  std::string_view child = {};
  std::string_view one_of = {};  ///< allowed values of a string or integer, "A|B|C"
  Repair repair = Repair::kRefuse;
  /// Counts if a required number is missing; NaN: none does.
  double otherwise = std::numeric_limits<double>::quiet_NaN();
  /// The value of a material's extension; null: it needs more than to be copied.
  float MaterialDescription::*number = nullptr;
  Rgb MaterialDescription::*color = nullptr;
  TextureDescription MaterialDescription::*texture = nullptr;
};

struct Schema {
  std::string_view name;
  std::span<const SchemaMember> members;
};

/// Returns the rows of schema `name`, such as "material", or "material/KHR_materials_sheen" for an
/// extension object. Null if there is none.
const std::span<const SchemaMember>* find_schema(std::string_view name);

/// Returns the schemas "material/NAME" of materials' extensions.
std::span<const Schema> material_extensions();

/// Returns whether files may require this extension.
bool is_supported_extension(std::string_view name);
/// Returns the extensions in alphabetical order.
std::span<const std::string_view> supported_extensions();

}  // namespace core
