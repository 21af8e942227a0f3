/// Converts files of other formats to GLB in a helper process, which a broken file may crash.
///
/// STL, OBJ, PLY and 3MF are read by `tessera-convert`, which is built where libassimp is
/// installed. Other formats are read by commands that the operator names. A helper has limits of
/// memory and time and no network; tessera-convert also opens no file and starts no process.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/scene_io/gltf_load.h"

namespace core {

struct Converters {
  std::string helper = {};  ///< path of tessera-convert; empty: not installed
  /// Paths of programs by extension in lower case ("step"), called with the file and a name for the
  /// GLB that they write.
  std::map<std::string, std::string, std::less<>> commands = {};

  /// Returns whether files with this extension (in lower case) are to be converted, with a
  /// converter or not.
  bool takes(std::string_view extension) const;
};

/// Returns the path of tessera-convert: TESSERA_CONVERTER, or beside the running program; empty if
/// it is not there.
std::string find_converter();

struct FileToConvert {
  std::string name;
  std::span<const std::byte> content;
};

struct ConvertLimits {
  std::uint64_t memory_bytes = std::uint64_t{4} << 30U;
  std::chrono::seconds time{60};
};
/// Returns the memory in which a file of this size is converted. tessera-convert took 13 times a
/// binary STL, 17 times an OBJ, 21 times a binary PLY and 65 times a 3MF (of a million triangles).
std::uint64_t conversion_bytes(std::string_view extension, std::uint64_t file_bytes);

struct Converted {
  Bytes glb;
  std::vector<std::string> notes;  ///< what the user should know, such as the unit
};

/// files: first the one to convert, then those to which it may refer (materials, textures).
/// Errors: kUnsupportedFormat with the remedy if there is no converter; kInvalidArgument with the
/// converter's message; kTooLarge beyond the limits; kCancelled.
Result<Converted> convert_to_glb(std::span<const FileToConvert> files, const Converters& converters,
                                 const ConvertLimits& limits, const std::stop_token& stop = {});

/// Returns the extension in lower case, without the dot.
std::string extension_of_name(std::string_view name);

}  // namespace core
