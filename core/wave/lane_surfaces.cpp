#include "core/wave/lane_surfaces.h"

#include <array>
#include <bit>

namespace core {
namespace {

/// A shading normal the viewer can see; as in core/materials/shade.cpp.
template <std::size_t N>
Vec3s<N> facing(Vec3s<N> n, Vec3s<N> wo) {
  const Floats<N> least(1e-3F);
  const Floats<N> cos_o = dot(n, wo);
  const Mask<N> away = ~(cos_o >= least);
  return away.any() ? select(away, normalize_or(n + wo * (least - cos_o), wo), n) : n;
}

template <std::size_t N>
using Corners = std::array<Vec3s<N>, 3>;

/// core/scene/surface_point.cpp
template <std::size_t N>
Vec3s<N> barycentrics(const Corners<N>& p, Vec3s<N> n, const SegmentLanes<N>& ray) {
  const Floats<N> zero(0);
  const Vec3s<N> q = cross(ray.origin - p[0], ray.direction);
  const Floats<N> d = dot(n, ray.direction);
  const auto clamped = [&](Floats<N> b) { return clamp01(select(b == b, b, zero)); };
  Floats<N> b1 = clamped(-dot(p[2] - p[0], q) / d);
  Floats<N> b2 = clamped(dot(p[1] - p[0], q) / d);
  const Floats<N> sum = b1 + b2;
  const Mask<N> outside = sum > Floats<N>(1);
  b1 = select(outside, b1 / sum, b1);
  b2 = select(outside, b2 / sum, b2);
  const Mask<N> grazing = d == zero;
  b1 = select(grazing, zero, b1);
  b2 = select(grazing, zero, b2);
  return {Floats<N>(1) - b1 - b2, b1, b2};
}

template <std::size_t N>
Vec3s<N> blend(const Corners<N>& p, Vec3s<N> b) {
  return p[0] * b.x + p[1] * b.y + p[2] * b.z;
}

/// core/scene/surface_point.cpp
template <std::size_t N>
Floats<N> bulge(const Corners<N>& p, const Corners<N>& n, Vec3s<N> b, Floats<N> side) {
  const auto edge = [&](std::size_t i, std::size_t j) {
    return max(side * dot(n[j] - n[i], p[j] - p[i]), Floats<N>(0));
  };
  return Floats<N>(0.5F) *
         (b.x * b.y * edge(0, 1) + b.y * b.z * edge(1, 2) + b.z * b.x * edge(2, 0));
}

/// A vector of each row, and the float behind it.
template <std::size_t N>
Vec3s<N> gather(const float* const (&rows)[N], Floats<N>& behind) {
  Floats<N> columns[4];
  transpose(rows, columns);
  behind = columns[3];
  return {columns[0], columns[1], columns[2]};
}

bool is_foreign(const Material& m) {
  const bool blends = m.has_alpha && m.factors.alpha_mode != AlphaMode::kMask;
  return m.has_layers || m.transmits || m.is_volume || m.is_clear || blends || m.factors.unlit ||
         m.factors.anisotropy > 0;
}

constexpr float kNothing[16] = {};

}  // namespace

template <std::size_t N>
struct LaneSurfaces::Rows {
  const float* positions[3][N];
  const float* normals[3][N];
  const float* material[4][N];
  Vec4 placed[3][N];  ///< positions of instances
  Vec4 turned[3][N];  ///< normals; w: 1 where it has yet to be made unit, as of instances
  alignas(32) float mirror[N];
  alignas(32) std::int32_t light[N];
  unsigned smooth = 0;
  unsigned double_sided = 0;

  Rows() {
    for (std::size_t k = 0; k < N; ++k) {
      for (std::size_t c = 0; c < 3; ++c) {
        positions[c][k] = normals[c][k] = kNothing;
      }
      for (auto& part : material) {
        part[k] = kNothing;
      }
      mirror[k] = 1;
      light[k] = 0;
    }
  }
};

LaneSurfaces::LaneSurfaces(const SceneData& scene) : scene_(scene) {
  for (const Material& m : scene.materials) {
    const BsdfParameters& b = m.plain;
    const Rgb e = m.is_emissive ? m.factors.emissive : Rgb{};
    materials_.push_back({{b.base_color.r, b.base_color.g, b.base_color.b, b.metallic,  //
                           b.roughness, b.alpha_x, b.f0.r, b.f0.g,                      //
                           b.f0.b, b.f90, e.r, e.g, e.b, 0, 0, 0}});
  }
  for (const PlacedMesh& placed : scene.placed) {
    const MeshData& mesh = scene.meshes[placed.mesh];
    const Material& m = scene.materials[mesh.material];
    const bool is_textured = m.has_texture || !mesh.colors.empty();
    const Kind kind = is_foreign(m) ? Kind::kForeign : is_textured ? Kind::kTextured : Kind::kPlain;
    placed_.push_back({mesh.positions.data(), mesh.normals.empty() ? nullptr : mesh.normals.data(),
                       mesh.indices.data(), &materials_[mesh.material], placed.first_light, kind,
                       m.has_alpha, m.factors.double_sided});
  }
}

template <std::size_t N>
void LaneSurfaces::meet(const SegmentLanes<N>& segments, const RawHit (&hits)[N], unsigned on,
                        MetLanes<N>& out) const {
  Rows<N> rows;
  unsigned plain = 0;
  unsigned textured = 0;
  out.foreign = 0;
  for (unsigned rest = on; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    const unsigned bit = 1U << k;
    const RawHit& hit = hits[k];
    const PlacedInstance* instance =
        hit.instance == kNoInstance ? nullptr : &scene_.instances[hit.instance];
    const Entry& mesh = placed_[(instance == nullptr ? 0 : instance->first_placed) + hit.geometry];
    if (mesh.kind == Kind::kForeign ||
        (mesh.may_be_hole &&
         scene_.coverage(hit, {segments.origin.lane(k), segments.direction.lane(k)}) < 1)) {
      out.foreign |= bit;
    } else if (mesh.kind == Kind::kTextured) {
      textured |= bit;
    } else {
      plain |= bit;
      add_triangle(rows, k, mesh, hit, instance == nullptr ? nullptr : &instance->to_world);
    }
  }
  if (plain != 0) {
    meet_plain(segments, rows, out);
  } else {
    out.surface = SurfaceLanes<N>();
  }
  for (; textured != 0; textured &= textured - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(textured));
    meet_textured(segments, hits[k], k, out);
  }
}

template <std::size_t N>
void LaneSurfaces::add_triangle(Rows<N>& rows, std::size_t k, const Entry& mesh, const RawHit& hit,
                                const Transform* to_world) {
  for (std::size_t part = 0; part < 4; ++part) {
    rows.material[part][k] = mesh.row->at + 4 * part;
  }
  const std::uint32_t* v = mesh.indices + 3 * std::size_t{hit.primitive};
  rows.light[k] = static_cast<std::int32_t>(
      mesh.first_light == kNoLight ? kNoLight : mesh.first_light + hit.primitive);
  rows.double_sided |= mesh.is_double_sided ? 1U << k : 0U;
  for (std::size_t c = 0; c < 3; ++c) {
    rows.positions[c][k] = &mesh.positions[v[c]].x;
  }
  if (to_world != nullptr) {
    rows.mirror[k] = to_world->determinant() < 0 ? -1.0F : 1.0F;
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3 p = to_world->point(mesh.positions[v[c]]);
      rows.placed[c][k] = {p.x, p.y, p.z, 0};
      rows.positions[c][k] = &rows.placed[c][k].x;
    }
  }
  if (mesh.normals != nullptr) {
    rows.smooth |= 1U << k;
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3 m = mesh.normals[v[c]];
      const Vec3 n = to_world == nullptr ? m : to_world->normal(m);
      rows.turned[c][k] = {n.x, n.y, n.z, to_world == nullptr ? 0.0F : 1.0F};
      rows.normals[c][k] = &rows.turned[c][k].x;
    }
  }
}

template <std::size_t N>
void LaneSurfaces::meet_plain(const SegmentLanes<N>& segments, const Rows<N>& rows,
                              MetLanes<N>& out) const {
  const Floats<N> zero(0);
  const Floats<N> one(1);
  const Vec3s<N> wo = -segments.direction;
  Floats<N> behind;
  Corners<N> p;
  for (std::size_t c = 0; c < 3; ++c) {
    p[c] = gather(rows.positions[c], behind);
  }
  const Vec3s<N> n = cross(p[1] - p[0], p[2] - p[0]);
  const Vec3s<N> b = barycentrics(p, n, segments);
  out.position = blend(p, b);
  const Floats<N> twice_area = length(n);
  const Vec3s<N> geometric = select(twice_area > zero, n * (load<N>(rows.mirror) / twice_area), wo);
  const Floats<N> cos_front = dot(geometric, wo);
  const Mask<N> front = cos_front >= zero;
  const Floats<N> side = select(front, one, Floats<N>(-1));
  SurfaceLanes<N>& s = out.surface;
  s.normal_geometric = geometric * side;
  s.horizon = s.normal_geometric;
  s.origin = out.position;
  Vec3s<N> shading = geometric;
  if (rows.smooth != 0) {
    Corners<N> corner;
    for (std::size_t c = 0; c < 3; ++c) {
      const Vec3s<N> as_given = gather(rows.normals[c], behind);
      corner[c] = select(behind > zero, normalize_or(as_given, geometric), as_given);
    }
    const Mask<N> is_smooth = Mask<N>::of(rows.smooth);
    shading = select(is_smooth, normalize_or(blend(corner, b), geometric), geometric);
    const Floats<N> above = bulge(p, corner, b, side);
    const Mask<N> round = is_smooth & (above > zero) & (dot(shading, geometric) > zero);
    if (round.any()) {
      s.horizon = select(round, facing(shading * side, wo), s.horizon);
      s.origin = select(round, out.position + shading * (side * above), s.origin);
    }
  }
  s.normal = facing(shading * side, wo);
  Floats<N> c[4][4];
  for (std::size_t part = 0; part < 4; ++part) {
    transpose(rows.material[part], c[part]);
  }
  s.base_color = {c[0][0], c[0][1], c[0][2]};
  s.metallic = c[0][3];
  s.roughness = c[1][0];
  s.alpha = c[1][1];
  s.f0 = {c[1][2], c[1][3], c[2][0]};
  s.f90 = c[2][1];
  const Mask<N> emits = (cos_front > zero) | Mask<N>::of(rows.double_sided);
  out.emitted = {select(emits, c[2][2], zero), select(emits, c[2][3], zero),
                 select(emits, c[3][0], zero)};
  out.light = load<N>(rows.light);
  out.distance_m = length(out.position - segments.origin);
  out.cone_width_m = segments.cone_width_m + segments.cone_spread_rad * out.distance_m;
}

template <std::size_t N>
void LaneSurfaces::meet_textured(const SegmentLanes<N>& segments, const RawHit& hit, std::size_t k,
                                 MetLanes<N>& out) const {
  const Ray ray = {segments.origin.lane(k), segments.direction.lane(k)};
  const SurfacePoint point = scene_.surface_point(hit, ray);
  const Material& material = scene_.materials[point.material];
  const Vec3 wo = -ray.direction;
  const float distance = length(point.position - ray.origin);
  const float cone = segments.cone_width_m.v[k] + segments.cone_spread_rad.v[k] * distance;
  Shading shading;
  shade(material, point, wo, {cone, segments.is_sharp.v[k] != 0}, shading);
  // Textures are not read for triangles that shine nowhere.
  const bool is_dark =
      point.light != kNoLight && is_black(scene_.triangle_lights[point.light].radiance);
  const Rgb light = is_dark ? Rgb{} : emitted(material, point, wo);
  const BsdfParameters& b = shading.bsdf;
  SurfaceLanes<N>& s = out.surface;
  s.normal_geometric.set(k, shading.normal_geometric);
  s.normal.set(k, shading.frame.n);
  s.horizon.set(k, shading.horizon);
  s.origin.set(k, shading.origin);
  s.base_color.set(k, {b.base_color.r, b.base_color.g, b.base_color.b});
  s.metallic.v[k] = b.metallic;
  s.roughness.v[k] = b.roughness;
  s.alpha.v[k] = b.alpha_x;
  s.f0.set(k, {b.f0.r, b.f0.g, b.f0.b});
  s.f90.v[k] = b.f90;
  out.position.set(k, point.position);
  out.emitted.set(k, {light.r, light.g, light.b});
  out.light.v[k] = static_cast<std::int32_t>(point.light);
  out.distance_m.v[k] = distance;
  out.cone_width_m.v[k] = cone;
}

#ifdef __AVX2__
template void LaneSurfaces::meet(const SegmentLanes<8>&, const RawHit (&)[8], unsigned,
                                 MetLanes<8>&) const;
#endif
template void LaneSurfaces::meet(const SegmentLanes<1>&, const RawHit (&)[1], unsigned,
                                 MetLanes<1>&) const;

}  // namespace core
