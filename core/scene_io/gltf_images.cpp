#include "core/scene_io/gltf_images.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <string_view>
#include <utility>

#include "core/base/cgroup.h"
#include "core/base/file_names.h"
#include "core/base/parallel_for.h"
#include "core/image_io/image_io.h"
#include "core/image_io/image_size.h"
#include "core/image_io/radiance.h"
#include "core/scene_io/gltf_model.h"
#include "core/scene_io/gltf_uri.h"

namespace core {
namespace {

/// Returns the media type of an image by its first bytes; empty for formats that glTF does not
/// name.
std::string_view media_type_of(std::span<const std::byte> file) {
  const std::string_view kind = image_kind(file);
  return kind == "png"    ? "image/png"
         : kind == "jpg"  ? "image/jpeg"
         : kind == "webp" ? "image/webp"
         : kind == "ktx2" ? "image/ktx2"
                          : std::string_view();
}

TextureWrap wrap_mode(int mode) noexcept {
  if (mode == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) {
    return TextureWrap::kClampToEdge;
  }
  return mode == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? TextureWrap::kMirroredRepeat
                                                       : TextureWrap::kRepeat;
}

// Returns translation * rotation * scale. "Rotate the UVs counter-clockwise" applies to the image,
// whose v points down.
std::array<float, 6> uv_matrix(const tinygltf::Value& transform) {
  const auto pair = [&transform](const char* name, float otherwise) {
    if (!transform.Has(name) || transform.Get(name).ArrayLen() != 2) {
      return Vec2{otherwise, otherwise};
    }
    const tinygltf::Value& v = transform.Get(name);
    return Vec2{static_cast<float>(v.Get(0).GetNumberAsDouble()),
                static_cast<float>(v.Get(1).GetNumberAsDouble())};
  };
  const Vec2 offset = pair("offset", 0);
  const Vec2 scale = pair("scale", 1);
  const float angle = value_number(transform, "rotation", 0);
  const float c = std::cos(angle);
  const float s = std::sin(angle);
  return {c * scale.x, s * scale.y, offset.x, -s * scale.x, c * scale.y, offset.y};
}

}  // namespace

bool is_there(const GltfImage& image, const ResolveUri& resolve) {
  return !image.uri || is_data_uri(*image.uri) ||
         (resolve && resolve(percent_decode(*image.uri)) != nullptr);
}

std::vector<int> choose_texture_images(const tinygltf::Model& model, const GltfTables& tables,
                                       const ResolveUri& resolve) {
  std::vector<int> chosen;
  for (const tinygltf::Texture& texture : model.textures) {
    int image = texture.source;
    for (const char* name : {"EXT_texture_webp", "KHR_texture_basisu"}) {
      const auto* extension = find_extension(texture.extensions, name);
      const int other = extension == nullptr ? -1 : value_integer(*extension, "source", -1);
      if (other >= 0 && tables.fault_of("images", other) == nullptr &&
          (image < 0 || is_there(tables.images[static_cast<std::size_t>(other)], resolve))) {
        image = other;
      }
    }
    chosen.push_back(tables.fault_of("images", image) == nullptr ? image : -1);
  }
  return chosen;
}

int GltfImages::add(Image image) {
  scene_.images.push_back(std::make_shared<const Image>(std::move(image)));
  return static_cast<int>(scene_.images.size()) - 1;
}

Result<int> GltfImages::noted(int image) {
  if (const auto it = by_file_index_.find(image); it != by_file_index_.end()) {
    return it->second;
  }
  const std::string where = "/images/" + std::to_string(image);
  auto file = source_.image_file(image);
  if (!file) {
    return file.error();
  }
  const std::string& said = source_.tables().images[static_cast<std::size_t>(image)].media_type;
  const std::string_view seen = media_type_of(*file);
  if (!said.empty() && !seen.empty() && said != seen) {
    scene_.warnings.emplace_back(
        "media_type", where + "/mimeType",
        '"' + said + "\" is not the type of the bytes, which are read as " + std::string(seen));
  }
  if (image_kind(*file) == "jpg" && !jpeg_is_whole(*file)) {
    scene_.warnings.emplace_back("image_cut", where,
                                 "the JPEG ends early; what is missing is grey");
  }
  if (auto warning = primaries_warning(*file, "image " + std::to_string(image)); !warning.empty()) {
    scene_.warnings.emplace_back("primaries", where, std::move(warning));
  }
  Noted note{.image = image, .to = scene_.images.size(), .file = *file};
  note.bytes_max = source_.budget().left();
  // Before decoding, if the header gives the size; else after.
  const auto header = read_image_header(*file);
  if (header) {
    const std::size_t bytes = header->value_count() * bytes_per_value(header->type);
    if (auto status = source_.budget().take_image(bytes, where); !status) {
      return status.error();
    }
  } else {
    note.pixels = decode_image(*file, {limits_.image_side_max, note.bytes_max});
    if (!*note.pixels) {
      return Error{note.pixels->error().code, note.pixels->error().message, where};
    }
    if (auto status = source_.budget().take_image((*note.pixels)->bytes.size(), where); !status) {
      return status.error();
    }
  }
  scene_.images.emplace_back();
  noted_.push_back(std::move(note));
  return by_file_index_[image] = static_cast<int>(scene_.images.size()) - 1;
}

Status GltfImages::decode_all() {
  parallel_for(usable_threads())(static_cast<int>(noted_.size()), [&](int i) {
    Noted& note = noted_[static_cast<std::size_t>(i)];
    try {
      const Status goes_on = limits_.admit ? limits_.admit(0) : ok_status();
      if (!goes_on) {
        note.pixels = goes_on.error();
      } else if (!note.pixels) {
        note.pixels = decode_image(note.file, {limits_.image_side_max, note.bytes_max});
        if (*note.pixels) {
          set_aside((*note.pixels)->bytes);
        }
      }
    } catch (...) {
      note.thrown = std::current_exception();
    }
  });
  for (Noted& note : noted_) {
    if (note.thrown != nullptr) {
      std::rethrow_exception(note.thrown);
    }
    if (!*note.pixels) {
      const Error& error = note.pixels->error();
      return Error{error.code, error.message, "/images/" + std::to_string(note.image)};
    }
    scene_.images[note.to] = std::make_shared<const Image>(**std::move(note.pixels));
  }
  noted_.clear();
  return ok_status();
}

Result<TextureDescription> GltfImages::texture(const TextureReference& reference) {
  TextureDescription description;
  if (reference.texture < 0) {
    return description;
  }
  const auto texture = static_cast<std::size_t>(reference.texture);
  if (texture_images_[texture] < 0) {
    scene_.warnings.emplace_back("texture_missing",
                                 "/textures/" + std::to_string(reference.texture),
                                 "the texture has no image and counts as white");
    return description;
  }
  auto image = noted(texture_images_[texture]);
  if (!image) {
    return image.error();
  }
  description.image = *image;
  description.uv_set = reference.uv_set;
  if (reference.transform != nullptr) {
    description.uv_transform = uv_matrix(*reference.transform);
    description.uv_set = value_integer(*reference.transform, "texCoord", reference.uv_set);
  }
  if (const int sampler = model_.textures[texture].sampler; sampler >= 0) {
    const tinygltf::Sampler& s = model_.samplers[static_cast<std::size_t>(sampler)];
    description.wrap_u = wrap_mode(s.wrapS);
    description.wrap_v = wrap_mode(s.wrapT);
    description.nearest = s.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
  }
  return description;
}

}  // namespace core
