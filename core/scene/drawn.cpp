#include "core/scene/drawn.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <map>
#include <utility>

#include "core/image_io/image_io.h"
#include "core/materials/texture_places.h"
#include "core/math/extreme_points.h"
#include "core/math/transform.h"

namespace core {
namespace {

/// Returns the last channel of a pixel, in [0, 1] for integers.
float alpha_at(const Image& image, int x, int y) noexcept {
  const auto pixel = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                     static_cast<std::size_t>(x);
  const std::size_t value = (pixel + 1) * static_cast<std::size_t>(image.channels) - 1;
  const std::byte* const at = image.bytes.data() + value * bytes_per_value(image.type);
  if (image.type == PixelType::kU8) {
    return static_cast<float>(*at) / std::numeric_limits<std::uint8_t>::max();
  }
  if (image.type == PixelType::kU16) {
    std::uint16_t alpha = 0;
    std::memcpy(&alpha, at, sizeof(alpha));
    return static_cast<float>(alpha) / std::numeric_limits<std::uint16_t>::max();
  }
  float alpha = 0;
  std::memcpy(&alpha, at, sizeof(alpha));
  return alpha;
}

class DrawnTriangles {
 public:
  explicit DrawnTriangles(const SceneDescription& scene) : scene_(scene) {}

  /// Calls visit(vertices) for each triangle of which something is drawn.
  template <typename Visit>
  void each_of(const PrimitiveDescription& primitive, const Visit& visit) {
    const bool has_material =
        primitive.material >= 0 &&
        static_cast<std::size_t>(primitive.material) < scene_.materials.size();
    const MaterialDescription& material =
        has_material ? scene_.materials[static_cast<std::size_t>(primitive.material)] : default_;
    const bool has_alpha = material.alpha_mode != AlphaMode::kOpaque;
    const auto vertex_alpha = [&](std::size_t vertex) {
      return vertex < primitive.colors.size() ? primitive.colors[vertex].w : 1.0F;
    };
    float most = material.base_alpha;
    if (has_alpha && !primitive.colors.empty()) {
      most *= std::max_element(primitive.colors.begin(), primitive.colors.end(),
                               [](const Vec4& a, const Vec4& b) { return a.w < b.w; })
                  ->w;
    }
    const float least = least_drawn_alpha(material, most);
    if (!(least <= 1)) {
      return;
    }
    const TextureDescription& texture = material.base_color_texture;
    const MarkedBlocks* const drawn = least > 0 ? blocks(texture, least) : nullptr;
    for (std::size_t i = 0; i + 2 < primitive.indices.size(); i += 3) {
      const std::array<std::size_t, 3> v = {primitive.indices[i], primitive.indices[i + 1],
                                            primitive.indices[i + 2]};
      if (std::max({v[0], v[1], v[2]}) >= primitive.positions.size()) {
        continue;
      }
      const float here = material.base_alpha *
                         std::max({vertex_alpha(v[0]), vertex_alpha(v[1]), vertex_alpha(v[2])});
      const auto& uv = primitive.uv[static_cast<std::size_t>(texture.uv_set)];
      if (!has_alpha ||
          (least_drawn_alpha(material, here) <= 1 &&
           (drawn == nullptr || has_mark(*drawn, texture, corners_in(texture, uv, v))))) {
        visit(v);
      }
    }
  }

 private:
  /// Returns where the texture's alpha is at least `least`; null if it has none.
  const MarkedBlocks* blocks(const TextureDescription& texture, float least) {
    if (texture.image < 0 || static_cast<std::size_t>(texture.image) >= scene_.images.size()) {
      return nullptr;
    }
    const Image* const image = scene_.images[static_cast<std::size_t>(texture.image)].get();
    if (image == nullptr || image->channels % 2 != 0 ||
        image->bytes.size() < image->value_count() * bytes_per_value(image->type)) {
      return nullptr;
    }
    return &blocks_
                .try_emplace({image, least}, image->width, image->height,
                             [&](int x, int y) { return alpha_at(*image, x, y) >= least; })
                .first->second;
  }

  const SceneDescription& scene_;
  MaterialDescription default_;
  std::map<std::pair<const Image*, float>, MarkedBlocks> blocks_;
};

bool has_area(const Transform& m) noexcept {
  const auto is_zero = [](Vec3 v) { return v.x == 0 && v.y == 0 && v.z == 0; };
  return !(is_zero(cross(m.x, m.y)) && is_zero(cross(m.y, m.z)) && is_zero(cross(m.z, m.x)));
}

}  // namespace

float least_drawn_alpha(const MaterialDescription& material, float most) noexcept {
  constexpr float kNone = std::numeric_limits<float>::infinity();
  if (material.alpha_mode == AlphaMode::kBlend) {
    return most > 0 ? std::numeric_limits<float>::min() : kNone;
  }
  if (material.alpha_mode == AlphaMode::kOpaque || material.alpha_cutoff <= 0) {
    return 0;
  }
  return most > 0 ? material.alpha_cutoff * kAlphaRounding / most : kNone;
}

bool is_drawn(const MaterialDescription& material) noexcept {
  return least_drawn_alpha(material, material.base_alpha) <= 1;
}

std::array<Vec2, 3> corners_in(const TextureDescription& texture, const std::vector<Vec2>& uv,
                               const std::array<std::size_t, 3>& vertices) {
  std::array<Vec2, 3> corners;
  for (std::size_t k = 0; k < 3; ++k) {
    corners[k] =
        transformed(texture.uv_transform, vertices[k] < uv.size() ? uv[vertices[k]] : Vec2{});
  }
  return corners;
}

bool has_mark(const MarkedBlocks& blocks, const TextureDescription& texture,
              const std::array<Vec2, 3>& corners) {
  const auto [u_low, u_high] = std::minmax({corners[0].x, corners[1].x, corners[2].x});
  const auto [v_low, v_high] = std::minmax({corners[0].y, corners[1].y, corners[2].y});
  return blocks.has_mark({u_low, v_low}, {u_high, v_high}, texture.wrap_u, texture.wrap_v);
}

std::vector<Vec3> extreme_points_of(const SceneDescription& scene) {
  ExtremePoints extremes;
  DrawnTriangles drawn(scene);
  for (const InstanceDescription& instance : scene.instances) {
    const auto mesh = static_cast<std::size_t>(instance.mesh);
    if (instance.is_ground || instance.mesh < 0 || mesh >= scene.meshes.size() ||
        !has_area(instance.to_world)) {
      continue;
    }
    for (const PrimitiveDescription& primitive : scene.meshes[mesh].primitives) {
      std::vector<bool> is_added(primitive.positions.size());
      drawn.each_of(primitive, [&](const std::array<std::size_t, 3>& vertices) {
        for (const std::size_t v : vertices) {
          if (!is_added[v]) {
            is_added[v] = true;
            extremes.add(exact_point(instance.to_world, primitive.positions[v]));
          }
        }
      });
    }
  }
  return extremes.points();
}

std::vector<Vec3> framed_points_of(const SceneDescription& scene) {
  return scene.framed.empty() ? extreme_points_of(scene) : scene.framed;
}

Bounds bounds_of(const SceneDescription& scene) {
  Bounds out;
  for (const Vec3& point : framed_points_of(scene)) {
    out.add(point);
  }
  return out;
}

}  // namespace core
