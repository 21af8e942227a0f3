#include "core/scene_io/gltf_container.h"

#include <algorithm>
#include <cstdint>
#include <string>

#include "core/base/byte_order.h"
#include "core/base/invalid.h"
#include "core/base/text.h"

namespace core {
namespace {

constexpr std::uint32_t kMagic = 0x46546C67;      // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr std::uint32_t kBinChunk = 0x004E4942;   // "BIN\0"
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 8;

/// Tests the first byte after white space and a byte order mark, as parsers do.
bool looks_like_an_object(std::string_view json) {
  json = without_byte_order_mark(json);
  const std::size_t first = json.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && json[first] == '{';
}

/// Returns "UTF-16" or "UTF-32" if the text begins with their byte order mark or, without one, with
/// "{"; else nothing.
std::string_view other_encoding(std::string_view text) {
  using std::string_view_literals::operator""sv;
  for (const std::string_view begin :
       {"\xFF\xFE\0\0"sv, "\0\0\xFE\xFF"sv, "{\0\0\0"sv, "\0\0\0{"sv}) {
    if (text.starts_with(begin)) {
      return "UTF-32";
    }
  }
  for (const std::string_view begin : {"\xFF\xFE"sv, "\xFE\xFF"sv, "{\0"sv, "\0{"sv}) {
    if (text.starts_with(begin)) {
      return "UTF-16";
    }
  }
  return {};
}

Status check_json(std::string_view json, const GltfLimits& limits) {
  if (json.size() > limits.json_bytes_max) {
    return Error{ErrorCode::kTooLarge,
                 "JSON of " + std::to_string(json.size()) + " bytes; at most " +
                     std::to_string(limits.json_bytes_max) + " are allowed",
                 ""};
  }
  int depth = 0;
  bool in_string = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_string) {
      if (c == '\\') {
        ++i;
      } else if (c == '"') {
        in_string = false;
      }
    } else if (c == '"') {
      in_string = true;
    } else if (c == '{' || c == '[') {
      if (++depth > limits.json_depth_max) {
        return invalid("JSON is nested deeper than " + std::to_string(limits.json_depth_max) +
                       " levels");
      }
    } else if (c == '}' || c == ']') {
      --depth;
    }
  }
  return ok_status();
}

Status wrong_length(std::size_t length, const std::string& truth, const std::string& remedy,
                    GltfRepairs& repairs) {
  return repairs.mended(
      "container", "",
      "the GLB says that it has " + std::to_string(length) + " bytes, but " + truth, remedy);
}

/// Reads chunks to the end of the file, whatever total length the header gives.
Result<GltfContainer> open_glb(std::span<const std::byte> file, GltfRepairs& repairs) {
  if (file.size() < kHeaderBytes + kChunkHeaderBytes) {
    return invalid("a GLB of " + std::to_string(file.size()) + " bytes is cut within its header");
  }
  if (const std::uint32_t version = u32_little(file, 4); version != 2) {
    return invalid("GLB container version " + std::to_string(version) + "; only 2 is read");
  }
  const std::size_t length = u32_little(file, 8);
  if (length > file.size()) {
    const auto status = wrong_length(length, "only " + std::to_string(file.size()) + " are there",
                                     "its chunks are read as far as they are there", repairs);
    if (!status) {
      return status.error();
    }
  }
  GltfContainer container;
  bool has_json = false;
  std::size_t at = kHeaderBytes;
  while (at < file.size() && (at < length || !container.has_bin)) {
    const std::size_t left = file.size() - at - std::min(kChunkHeaderBytes, file.size() - at);
    const bool is_cut = file.size() - at < kChunkHeaderBytes;
    std::size_t bytes = is_cut ? 0 : u32_little(file, at);
    if (is_cut || bytes > left + kPaddingMax) {
      if (at >= length) {
        break;  // not a chunk
      }
      return invalid(is_cut ? "the GLB is cut within a chunk header"
                            : "a GLB chunk of " + std::to_string(bytes) +
                                  " bytes does not fit in the " + std::to_string(left) +
                                  " bytes that are left");
    }
    if (bytes > left) {
      const auto status =
          repairs.mended("padding", "",
                         "a GLB chunk of " + std::to_string(bytes) + " bytes does not fit in the " +
                             std::to_string(left) + " bytes that are left",
                         "it ends with the file");
      if (!status) {
        return status.error();
      }
      bytes = left;
    }
    const std::uint32_t type = u32_little(file, at + 4);
    at += kChunkHeaderBytes;
    const auto chunk = file.subspan(at, bytes);
    if (!has_json) {
      if (type != kJsonChunk) {
        return invalid("the first chunk of a GLB has to be JSON");
      }
      has_json = true;
      container.json = {reinterpret_cast<const char*>(chunk.data()), chunk.size()};
    } else if (type == kBinChunk && !container.has_bin) {
      container.bin = chunk;
      container.has_bin = true;
    }
    at += bytes;
  }
  if (!has_json) {
    return invalid("the GLB has no JSON chunk");
  }
  if (length < at) {
    const auto status =
        wrong_length(length, "its chunks have " + std::to_string(at), "all are read", repairs);
    if (!status) {
      return status.error();
    }
  } else if (at < file.size()) {
    repairs.note("container", "",
                 std::to_string(file.size() - at) + " bytes after the GLB are ignored");
  }
  return container;
}

/// Some writers pad the JSON with zeros instead of spaces.
Status strip_zeros(std::string_view& json, GltfRepairs& repairs) {
  const std::size_t end = json.find_last_not_of('\0') + 1;  // npos + 1 is 0
  if (end == json.size()) {
    return ok_status();
  }
  const std::string zeros = std::to_string(json.size() - end);
  json = json.substr(0, end);
  return repairs.mended("padding", "", "the JSON is followed by " + zeros + " bytes of zero",
                        "they are ignored");
}

}  // namespace

Result<GltfContainer> open_container(std::span<const std::byte> file, const GltfLimits& limits,
                                     GltfRepairs& repairs) {
  GltfContainer container;
  if (file.size() >= 4 && u32_little(file, 0) == kMagic) {
    auto glb = open_glb(file, repairs);
    if (!glb) {
      return glb;
    }
    container = *glb;
  } else {
    container.json = {reinterpret_cast<const char*>(file.data()), file.size()};
    if (const auto encoding = other_encoding(container.json); !encoding.empty()) {
      return invalid("the glTF JSON is encoded in " + std::string(encoding) + "; it must be UTF-8");
    }
    if (!looks_like_an_object(container.json)) {
      return invalid(
          "this is neither a GLB nor glTF JSON: the one begins with \"glTF\", the other with "
          "\"{\"");
    }
  }
  if (auto status = strip_zeros(container.json, repairs); !status) {
    return status.error();
  }
  if (auto status = check_json(container.json, limits); !status) {
    return status.error();
  }
  return container;
}

}  // namespace core
