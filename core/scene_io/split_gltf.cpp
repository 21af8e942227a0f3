#include "core/scene_io/split_gltf.h"

#include <exception>
#include <memory>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/base/sha256.h"
#include "core/scene_io/gltf_container.h"
#include "core/scene_io/gltf_json.h"
#include "core/scene_io/gltf_repairs.h"
#include "core/scene_io/gltf_uri.h"

namespace core {
namespace {

/// Returns the index of the quote that ends a string; npos if none does.
std::size_t end_of_string(std::string_view json, std::size_t begin) {
  for (std::size_t quote = json.find('"', begin); quote != std::string_view::npos;
       quote = json.find('"', quote + 1)) {
    const std::size_t before = json.find_last_not_of('\\', quote - 1);
    if ((quote - 1 - before) % 2 == 0) {
      return quote;
    }
  }
  return std::string_view::npos;
}

/// Returns the document with names of files where its uris had data.
Result<std::string> take_data(std::string_view json, std::map<std::string, SharedBytes>& files) {
  std::string out;
  std::string_view previous;
  std::size_t copied = 0;
  for (std::size_t quote = json.find('"'); quote != std::string_view::npos;) {
    const std::size_t begin = quote + 1;
    const std::size_t end = end_of_string(json, begin);
    if (end == std::string_view::npos) {
      break;  // The parser refuses it.
    }
    const std::string_view text = json.substr(begin, end - begin);
    // Slashes may be escaped in JSON. Such a uri stays as it is.
    if (previous == "uri" && is_data_uri(text) && text.find('\\') == std::string_view::npos) {
      auto bytes = decode_data_uri(text);
      if (!bytes) {
        return bytes.error();
      }
      const std::string name = sha256_hex(bytes->data(), bytes->size());
      files.try_emplace(name, std::make_shared<const Bytes>(*std::move(bytes)));
      out.append(json.substr(copied, begin - copied)).append(name);
      copied = end;
    }
    previous = text;
    quote = json.find('"', end + 1);
  }
  return out.append(json.substr(copied));
}

/// Turns all scenes by a quarter about x: z becomes y, and y becomes -z.
void turn_scenes(GltfJson& gltf) {
  const auto scenes = gltf.find("scenes");
  if (scenes == gltf.end() || !scenes->is_array()) {
    return;
  }
  for (GltfJson& scene : *scenes) {
    if (!scene.is_object() || !scene.contains("nodes") || !gltf["nodes"].is_array()) {
      continue;
    }
    constexpr double kHalf = std::numbers::sqrt2 / 2;
    GltfJson& nodes = gltf["nodes"];
    const std::size_t root = nodes.size();
    nodes.push_back({{"rotation", {-kHalf, 0, 0, kHalf}}, {"children", scene["nodes"]}});
    scene["nodes"] = GltfJson::array({root});
  }
}

/// Errors: exceptions for members that are missing or of another type.
void join(SplitGltf& split) {
  const auto* text = reinterpret_cast<const char*>(split.document.data());
  GltfJson gltf = GltfJson::parse(text, text + split.document.size());
  std::map<std::string, SharedBytes> files = split.files;
  Bytes all;
  std::vector<std::size_t> begins;
  for (const GltfJson& buffer : gltf.at("buffers")) {
    const std::string name = buffer.at("uri").get<std::string>();
    const SharedBytes bytes = split.files.at(name);
    all.resize((all.size() + 3) / 4 * 4);  // as accessors need it
    begins.push_back(all.size());
    all.insert(all.end(), bytes->begin(), bytes->end());
    files.erase(name);
  }
  for (GltfJson& view : gltf.at("bufferViews")) {
    const std::size_t begin = begins.at(view.at("buffer").get<std::size_t>());
    view["byteOffset"] = begin + view.value("byteOffset", std::size_t{0});
    view["buffer"] = 0;
  }
  for (const GltfJson& image : gltf.value("images", GltfJson::array())) {
    if (image.contains("uri") && !files.contains(image["uri"].get<std::string>())) {
      return;  // An image in the file of a buffer.
    }
  }
  const std::string name = sha256_hex(all.data(), all.size());
  gltf["buffers"] = GltfJson::array({{{"byteLength", all.size()}, {"uri", name}}});
  files[name] = std::make_shared<const Bytes>(std::move(all));
  const std::string joined = gltf.dump(-1, ' ', false, GltfJson::error_handler_t::replace);
  const auto bytes = std::as_bytes(std::span<const char>(joined));
  split = {.document = Bytes(bytes.begin(), bytes.end()), .files = std::move(files)};
}

}  // namespace

SplitGltf join_buffers(SplitGltf split) {
  try {
    join(split);
  } catch (const std::exception&) {
    return split;  // The loader says what is wrong.
  }
  return split;
}

Result<SplitGltf> split_gltf(std::string_view json, bool turns_z_up, const GltfLimits& limits) {
  SplitGltf split;
  auto text = take_data(json, split.files);
  if (!text) {
    return text.error();
  }
  if (turns_z_up) {
    GltfRepairs repairs(/*is_strict=*/false);
    const auto container =
        open_container(std::as_bytes(std::span<const char>(*text)), limits, repairs);
    if (!container) {
      return container.error();
    }
    GltfJson gltf = GltfJson::parse(container->json, nullptr, /*allow_exceptions=*/false);
    if (gltf.is_object()) {  // Otherwise the loader says what is wrong, and where.
      turn_scenes(gltf);
      *text = gltf.dump(-1, ' ', false, GltfJson::error_handler_t::replace);
    }
  }
  const auto bytes = std::as_bytes(std::span<const char>(*text));
  split.document.assign(bytes.begin(), bytes.end());
  return split;
}

}  // namespace core
