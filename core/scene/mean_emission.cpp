#include "core/scene/mean_emission.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "core/math/numbers.h"
#include "core/scene/drawn.h"

namespace core {
namespace {

/// Calls visit(b1, b2) with the weights of the second and third corner at the centres of the
/// upright ones of side^2 equal parts of a triangle; returns their number.
template <typename Visit>
int each_part(int side, Visit&& visit) {
  for (int i = 0; i < side; ++i) {
    for (int k = 0; k <= i; ++k) {
      visit((static_cast<float>(k) + 1.0F / 3) / static_cast<float>(side),
            (static_cast<float>(i - k) + 1.0F / 3) / static_cast<float>(side));
    }
  }
  return side * (side + 1) / 2;
}

/// A triangle in texture coordinates.
struct UvTriangle {
  std::array<Vec2, 3> corner;

  UvTriangle(const MeshData& mesh, const std::array<std::size_t, 3>& vertices,
             const TextureDescription& d)
      : corner(corners_in(d, mesh.uv[static_cast<std::size_t>(d.uv_set)], vertices)) {}
  /// Averages each part by the mip pyramid.
  Rgb mean(const Texture& texture, const TextureDescription& d) const {
    constexpr int kSide = 4;
    const Vec2 edge1 = corner[1] - corner[0];
    const Vec2 edge2 = corner[2] - corner[0];
    Rgb sum;
    const int parts = each_part(kSide, [&](float b1, float b2) {
      const Vec4 c = texture.sample({.uv = corner[0] + edge1 * b1 + edge2 * b2,
                                     .across = edge1 * (1.0F / kSide),
                                     .along = edge2 * (1.0F / kSide),
                                     .taps_max = kTextureTapsMax,
                                     .wrap_u = d.wrap_u,
                                     .wrap_v = d.wrap_v});
      sum += Rgb{c.x, c.y, c.z};
    });
    return sum / static_cast<float>(parts);
  }
};

}  // namespace

struct MeanEmission::Corners {
  std::array<std::size_t, 3> vertices{};
  std::array<Vec4, 3> color;  ///< of the vertices; white if there are none

  Corners(const MeshData& mesh, std::uint32_t triangle) {
    for (std::size_t k = 0; k < 3; ++k) {
      vertices[k] = mesh.indices[3 * std::size_t{triangle} + k];
      color[k] = mesh.colors.empty() ? Vec4{1, 1, 1, 1} : mesh.colors[vertices[k]];
    }
  }
};

const MarkedBlocks& MeanEmission::colored(const Texture& texture) {
  return colored_
      .try_emplace(&texture, texture, [&](int x, int y) { return !texture.is_black(x, y); })
      .first->second;
}

const MarkedBlocks& MeanEmission::opaque(const Texture& texture, float least) {
  return opaque_
      .try_emplace({&texture, least}, texture,
                   [&](int x, int y) { return texture.alpha(x, y) >= least; })
      .first->second;
}

/// Returns the mean coverage of the triangle; 0 only if all of it is a hole.
float MeanEmission::coverage(const TriangleLight& light, const Material& material,
                             const Corners& at) {
  if (!material.has_alpha) {
    return 1;
  }
  const MaterialDescription& f = material.factors;
  const float most = f.base_alpha * std::max({at.color[0].w, at.color[1].w, at.color[2].w});
  const TextureSlot& slot = material.base_color;
  const float least = least_drawn_alpha(f, most);  // between vertices alpha is no higher
  if (!(least <= 1)) {
    return 0;
  }
  if (slot.texture != nullptr && least > 0) {
    const UvTriangle uv(scene_.meshes[scene_.placed[light.placed].mesh], at.vertices,
                        slot.description);
    if (!has_mark(opaque(*slot.texture, least), slot.description, uv.corner)) {
      return 0;
    }
  }
  const RawHit hit = scene_.hit_of(light);
  const auto at_point = [&](float b1, float b2) {
    return scene_.coverage(hit, {light.p0 + light.edge1 * b1 + light.edge2 * b2, -light.normal});
  };
  if (!light.varies) {
    return at_point(1.0F / 3, 1.0F / 3);
  }
  constexpr int kSide = 8;
  float sum = 0;
  const int parts = each_part(kSide, [&](float b1, float b2) { sum += at_point(b1, b2); });
  constexpr float kLeast = 1.0F / 255;  // what lies between the points may be visible
  return std::max(sum / static_cast<float>(parts), kLeast);
}

Rgb MeanEmission::of(const TriangleLight& light) {
  const MeshData& mesh = scene_.meshes[scene_.placed[light.placed].mesh];
  const Material& material = scene_.materials[mesh.material];
  const MaterialDescription& f = material.factors;
  const Corners at(mesh, light.triangle);
  const float covered = coverage(light, material, at);
  Rgb mean = (f.unlit ? f.base_color : f.emissive) * covered;
  if (light.is_coated) {
    mean *= 1 - clamp01(f.clearcoat) * (0.04F + 0.96F / 21);  // the mean of Schlick's curve
  }
  if (f.unlit && !mesh.colors.empty()) {
    Rgb sum;
    for (const Vec4& c : at.color) {
      sum += Rgb{c.x, c.y, c.z};
    }
    mean *= sum / 3.0F;
  }
  const TextureSlot& slot = f.unlit ? material.base_color : material.emissive;
  if (slot.texture == nullptr || is_black(mean)) {
    return mean;
  }
  const UvTriangle uv(mesh, at.vertices, slot.description);
  if (!has_mark(colored(*slot.texture), slot.description, uv.corner)) {
    return {};
  }
  // Coarse levels of 8-bit textures round values below half of the first step of the sRGB curve to
  // black.
  constexpr float kLeast = 0.5F / 255 / 12.92F;
  const Rgb seen = uv.mean(*slot.texture, slot.description);
  return mean * (luminance(seen) > kLeast ? seen : Rgb(kLeast));
}

}  // namespace core
