#include "core/scene_io/gltf_environment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <utility>

#include "core/color/rgb.h"
#include "core/image_io/image_io.h"
#include "core/image_io/radiance.h"
#include "core/math/area_cover.h"
#include "core/math/numbers.h"
#include "core/math/vec.h"
#include "core/scene_io/gltf_model.h"
#include "core/scene_io/gltf_nodes.h"

namespace core {
namespace {

constexpr std::size_t kFaces = 6;
/// Texels of the map per face edge: at the centre of a face, where the map is finest, 4/pi times
/// those of the face. Larger faces are averaged.
constexpr int kFaceMax = 2048;
/// Lookups per texel of the map in each direction.
constexpr int kTaps = 2;
/// Floats of the map, plus Environment's data per texel: colour and two weights.
constexpr std::uint64_t kTexelBytes = 12 + 28;

struct Face {
  int side = 0;
  std::vector<Rgb> texels;
};

/// Returns the light of the scene; null if it has none.
const tinygltf::Value* light_of(const tinygltf::Model& model, int scene) {
  if (scene < 0) {
    return nullptr;
  }
  const auto* use = find_extension(model.scenes[static_cast<std::size_t>(scene)].extensions,
                                   "EXT_lights_image_based");
  const auto* all = find_extension(model.extensions, "EXT_lights_image_based");
  if (use == nullptr || all == nullptr) {
    return nullptr;
  }
  const auto index = static_cast<std::size_t>(value_integer(*use, "light", 0));
  return &value_array(all->Get("lights"))[index];
}

std::vector<int> faces_of(const tinygltf::Value& light) {
  std::vector<int> images;
  for (const tinygltf::Value& image : value_array(value_array(light.Get("specularImages"))[0])) {
    images.push_back(image.GetNumberAsInt());
  }
  return images;
}

/// Averages a face by area to at most kFaceMax texels per edge.
Face reduced(Face face) {
  if (face.side <= kFaceMax) {
    return face;
  }
  const std::vector<AreaCover> covers = area_covers(face.side, kFaceMax);
  Face small{kFaceMax, {}};
  for (const AreaCover& row : covers) {
    for (const AreaCover& column : covers) {
      Rgb sum = {0, 0, 0};
      for_each_covered(column, row, [&](int x, int y, float share) {
        sum += face.texels[static_cast<std::size_t>(y) * static_cast<std::size_t>(face.side) +
                           static_cast<std::size_t>(x)] *
               share;
      });
      small.texels.push_back(sum);
    }
  }
  return small;
}

Result<Face> read_face(int index, GltfSource& source, const GltfLimits& limits,
                       std::vector<Warning>& warnings) {
  const std::string where = "/images/" + std::to_string(index);
  const auto file = source.image_file(index);
  if (!file) {
    return file.error();
  }
  const auto image = decode_image(*file, {limits.image_side_max, source.budget().left()});
  if (!image) {
    return Error{image.error().code, image.error().message, where};
  }
  if (image->width != image->height) {
    return Error{ErrorCode::kInvalidArgument, "the faces of a cube map must be square", where};
  }
  const auto side = static_cast<std::size_t>(image->width);
  if (auto status = source.budget().take(image->bytes.size() + side * side * sizeof(Rgb), where);
      !status) {
    return status.error();
  }
  if (auto warning = radiance_warning(*file, *image, "image " + std::to_string(index));
      !warning.empty()) {
    warnings.emplace_back("texels", where, std::move(warning));
  }
  return reduced({image->width, radiance_of(*image, AlphaUse::kDivisor)});
}

/// Returns the light from a direction in the cube's frame. Order of the faces, and s and t on each:
/// OpenGL 4.6, table 8.19.
Rgb light_from(const std::array<Face, kFaces>& faces, Vec3 d) {
  const Vec3 a = {std::abs(d.x), std::abs(d.y), std::abs(d.z)};
  std::size_t face = 0;
  float s = 0;
  float t = -d.y;
  float major = a.x;
  if (a.x >= a.y && a.x >= a.z) {
    face = d.x > 0 ? 0 : 1;
    s = d.x > 0 ? -d.z : d.z;
  } else if (a.y >= a.z) {
    face = d.y > 0 ? 2 : 3;
    s = d.x;
    t = d.y > 0 ? d.z : -d.z;
    major = a.y;
  } else {
    face = d.z > 0 ? 4 : 5;
    s = d.z > 0 ? d.x : -d.x;
    major = a.z;
  }
  const Face& f = faces[face];
  const auto place = [&f](float coordinate) {
    const auto i = static_cast<int>(0.5F * (coordinate + 1) * static_cast<float>(f.side));
    return static_cast<std::size_t>(std::clamp(i, 0, f.side - 1));
  };
  const std::size_t column = place(-s / major);  // flipped horizontally
  return f.texels[place(t / major) * static_cast<std::size_t>(f.side) + column];
}

/// Applies the inverse of a rotation: from world to light space.
Vec3 to_light(const std::array<float, 4>& q, Vec3 d) {
  const Vec3 axis = {-q[0], -q[1], -q[2]};
  const Vec3 twice = cross(axis, d) * 2.0F;
  return d + twice * q[3] + cross(axis, twice);
}

std::array<float, 4> rotation_of(const tinygltf::Value& light) {
  std::array<float, 4> q = {0, 0, 0, 1};
  if (light.Has("rotation")) {
    const auto& values = value_array(light.Get("rotation"));
    for (std::size_t i = 0; i < q.size(); ++i) {
      q[i] = static_cast<float>(values[i].GetNumberAsDouble());
    }
  }
  const float length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(length > 0)) {
    return {0, 0, 0, 1};
  }
  for (float& v : q) {
    v /= length;
  }
  return q;
}

}  // namespace

Result<std::vector<int>> images_of_environment(const tinygltf::Model& model, int scene_index) {
  const auto scene = chosen_scene(model, scene_index);
  if (!scene) {
    return scene.error();
  }
  const tinygltf::Value* const light = light_of(model, *scene);
  return light == nullptr ? std::vector<int>() : faces_of(*light);
}

Result<std::shared_ptr<const Image>> read_environment(const tinygltf::Model& model,
                                                      GltfSource& source,
                                                      const GltfOptions& options,
                                                      std::vector<Warning>& warnings) {
  const auto scene = chosen_scene(model, options.scene_index);
  if (!scene) {
    return scene.error();
  }
  const tinygltf::Value* const light = light_of(model, *scene);
  if (light == nullptr) {
    return std::shared_ptr<const Image>();
  }
  const std::vector<int> images = faces_of(*light);
  std::array<Face, kFaces> faces;
  int side = 1;
  for (std::size_t i = 0; i < kFaces; ++i) {
    auto face = read_face(images[i], source, options.limits, warnings);
    if (!face) {
      return face.error();
    }
    faces[i] = *std::move(face);
    side = std::max(side, faces[i].side);
  }
  Image map{4 * side, 2 * side, 3, PixelType::kF32, {}};
  const auto texels = static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height);
  if (auto status =
          source.budget().take(texels * kTexelBytes, "/extensions/EXT_lights_image_based");
      !status) {
    return status.error();
  }
  map.bytes.resize(texels * sizeof(Rgb));
  const std::array<float, 4> rotation = rotation_of(*light);
  const float scale = value_number(*light, "intensity", 1) / (kTaps * kTaps);
  for (std::size_t i = 0; i < texels; ++i) {
    Rgb sum = {0, 0, 0};
    for (int tap = 0; tap < kTaps * kTaps; ++tap) {
      const auto within = [](int n) { return (static_cast<float>(n) + 0.5F) / kTaps; };
      const auto x = static_cast<float>(i % static_cast<std::size_t>(map.width));
      const auto y = static_cast<float>(i / static_cast<std::size_t>(map.width));
      // The inverse of Environment's u = 0.5 + atan2(d.z, d.x) / 2pi, v = acos(d.y) / pi.
      const float phi = kTwoPi * ((x + within(tap % kTaps)) / static_cast<float>(map.width) - 0.5F);
      const float theta = kPi * (y + within(tap / kTaps)) / static_cast<float>(map.height);
      const Vec3 d = {std::sin(theta) * std::cos(phi), std::cos(theta),
                      std::sin(theta) * std::sin(phi)};
      sum = sum + light_from(faces, to_light(rotation, d));
    }
    const Rgb mean = sum * scale;
    std::memcpy(map.bytes.data() + i * sizeof(Rgb), &mean, sizeof(Rgb));
  }
  return std::make_shared<const Image>(std::move(map));
}

}  // namespace core
