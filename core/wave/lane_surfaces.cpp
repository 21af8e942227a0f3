#include "core/wave/lane_surfaces.h"

#include <bit>

#include "core/math/offset_ray.h"
#include "core/transport/solid_faces.h"
#include "core/wave/lane_holes.h"
#include "core/wave/lane_maps.h"

namespace core {
namespace {

/// Returns whether the axes of the normal map are not the mesh's tangents, which lanes take.
bool turns_tangents(const MeshData& mesh, const TextureSlot& normal) {
  return normal.texture != nullptr && mesh.tangent_uv_set >= 0 &&
         (normal.axes.along_tangent != 1 || normal.axes.sign < 0 ||
          normal.description.uv_set != mesh.tangent_uv_set);
}

/// Returns whether the material has layers besides those that lanes know.
bool has_other_layers(SurfaceLayers layers) {
  layers.clearcoat = layers.iridescence = layers.diffuse_transmission = 0;
  layers.sheen_color = {};
  return layers.has_layers();
}

/// is_solid: the material is on the boundary of a solid.
bool is_unsupported(const Material& m, bool is_solid) {
  const bool is_for_walls = m.is_clear || m.factors.diffuse_transmission > 0;
  return has_other_layers(m.factors) || m.factors.unlit ||
         (m.is_volume && (is_for_walls || (m.transmits && !is_solid)));
}

/// Returns SceneData::coverage() if it is known to be the same everywhere, else -1. varies: a
/// texture or vertex colours have alpha.
float same_coverage(const Material& m, bool varies) {
  if (!m.has_alpha) {
    return 1;
  }
  const bool is_blended = m.factors.alpha_mode == AlphaMode::kBlend;
  return is_blended && !varies ? clamp01(m.factors.base_alpha) : -1;
}

/// A texture and a coat change emission from point to point; of these surfaces, lanes handle only
/// the triangles that are dark.
bool shines_alone(const Material& m) {
  return m.is_emissive && (m.emissive.texture != nullptr || m.factors.clearcoat > 0);
}

/// Adds a lane's values beyond SurfaceLanes, except for the normal of the coat.
template <std::size_t N>
void set_extras(const LaneMesh& mesh, std::size_t k, const BsdfParameters& b, const BsdfLayers& l,
                LaneHits<N>& out) {
  const auto vec = [](Rgb c) { return Vec3{c.r, c.g, c.b}; };
  const unsigned bit = 1U << k;
  if (mesh.has_layers) {
    out.layered |= bit;
    set_lane(out.layers, k, l);
  }
  if (mesh.solid != kNoSolid) {
    if (out.solid == 0) {
      out.solids = {Floats<N>(0), Vec3s<N>(Vec3{1, 1, 1}), Floats<N>(1), Mask<N>::of(0)};
    }
    out.solid |= bit;
    out.solids.transmission.v[k] = b.transmission;
    out.solids.specular_color.set(k, vec(b.specular_color));
  }
  if (mesh.is_wall) {
    if (out.wall == 0) {
      out.walls = {Floats<N>(0), Floats<N>(0), Vec3s<N>(Vec3{})};
    }
    out.wall |= bit;
    out.walls.transmission.v[k] = b.transmission;
    out.walls.diffuse.v[k] = l.diffuse_transmission;
    out.walls.diffuse_color.set(k, vec(l.diffuse_transmission_color));
  }
  if (mesh.has_film) {
    out.films.on |= bit;
    out.films.weight.v[k] = l.iridescence;
    out.films.ior.v[k] = l.iridescence_ior;
    out.films.thickness_nm.v[k] = l.iridescence_thickness_nm;
    out.films.wavelengths_nm.set(k, {});
  }
}

/// Turns the coat's normal from world space into the frame of the surface's. Sets all to 0 if there
/// are no layers yet.
template <std::size_t N>
[[gnu::noinline]] void finish(LaneHits<N>& out) {
  LayerLanes<N>& layers = out.layers;
  if (out.layered == 0) {
    layers = {};
    return;
  }
  layers.clearcoat_normal = frame_from_normal(out.surface.normal).to_local(layers.clearcoat_normal);
}

/// Addresses of the lanes' triangles and materials, as rows of floats.
template <std::size_t N>
struct FaceRows {
  const float* positions[3][N];
  const float* normals[3][N];
  const float* material[N];
  Vec4 placed[3][N];  ///< positions of instances
  Vec4 turned[3][N];  ///< normals of instances and motion, not normalised
  alignas(32) float mirror[N];
  alignas(32) float spread[N];  ///< InstanceError
  alignas(32) float place_m[N];
  alignas(32) std::int32_t light[N];
  unsigned smooth = 0;
  unsigned moved = 0;          ///< those of `turned`
  unsigned round[2] = {0, 0};  ///< MeshData::round_sides: front, back
  unsigned emits_from_both_sides = 0;

  FaceRows() {
    for (std::size_t k = 0; k < N; ++k) {
      mirror[k] = spread[k] = 1;
      place_m[k] = 0;
      light[k] = 0;
    }
  }
  /// Completes the addresses. set: lanes that have a triangle.
  void complete(unsigned set) {
    constexpr unsigned kAll = (1U << N) - 1;
    for (unsigned rest = kAll & ~set; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      for (std::size_t c = 0; c < 3; ++c) {
        positions[c][k] = kNothing;
      }
      material[k] = kNothing;
    }
    for (unsigned rest = smooth != 0 ? kAll & ~smooth : 0; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      for (std::size_t c = 0; c < 3; ++c) {
        normals[c][k] = kNothing;
      }
    }
  }
};

MeshAt mesh_at(const LaneMesh& mesh, const PlacedInstance* instance, float time) {
  return {*mesh.mesh, instance == nullptr ? nullptr : &instance->to_world, time};
}

template <std::size_t N>
[[gnu::noinline]] void move_positions(FaceRows<N>& rows, std::size_t k, const MeshAt& mesh,
                                      const std::uint32_t* v) {
  const Corners<Vec3> p = mesh.corners(v);
  for (std::size_t c = 0; c < 3; ++c) {
    rows.placed[c][k] = {p[c].x, p[c].y, p[c].z, 0};
    rows.positions[c][k] = &rows.placed[c][k].x;
  }
}

template <std::size_t N>
[[gnu::noinline]] void move_normals(FaceRows<N>& rows, std::size_t k, const MeshAt& mesh,
                                    const std::uint32_t* v) {
  const Corners<Vec3> n = {mesh.normal(v[0]), mesh.normal(v[1]), mesh.normal(v[2])};
  for (std::size_t c = 0; c < 3; ++c) {
    rows.turned[c][k] = {n[c].x, n[c].y, n[c].z, 0};
    rows.normals[c][k] = &rows.turned[c][k].x;
  }
  rows.moved |= 1U << k;
}

template <std::size_t N>
[[gnu::always_inline]] inline void add_face(FaceRows<N>& rows, std::size_t k, const LaneMesh& mesh,
                                            const RawHit& hit, const PlacedInstance* instance,
                                            float time) {
  const std::uint32_t* v = mesh.indices + 3 * std::size_t{hit.primitive};
  for (std::size_t c = 0; c < 3; ++c) {
    rows.positions[c][k] = &mesh.positions[v[c]].x;
  }
  if (instance != nullptr) {
    rows.mirror[k] = instance->to_world.determinant() < 0 ? -1.0F : 1.0F;
    rows.spread[k] = instance->error.spread;
    rows.place_m[k] = instance->error.place_m;
  }
  if (instance != nullptr || mesh.moves) {
    move_positions(rows, k, mesh_at(mesh, instance, time), v);
  }
}

template <std::size_t N>
void add_triangle(FaceRows<N>& rows, std::size_t k, const LaneMesh& mesh, const RawHit& hit,
                  const PlacedInstance* instance, float time) {
  rows.material[k] = mesh.row->at;
  rows.light[k] = static_cast<std::int32_t>(
      mesh.first_light == kNoLight ? kNoLight : mesh.first_light + hit.primitive);
  rows.emits_from_both_sides |= mesh.emits_from_both_sides ? 1U << k : 0U;
  add_face(rows, k, mesh, hit, instance, time);
  const std::uint32_t* v = mesh.indices + 3 * std::size_t{hit.primitive};
  if (mesh.normals != nullptr) {
    rows.smooth |= 1U << k;
    if (mesh.round_sides != nullptr) {
      const unsigned sides = mesh.round_sides[hit.primitive];
      rows.round[0] |= (sides & 1U) << k;
      rows.round[1] |= (sides >> 1 & 1U) << k;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      rows.normals[c][k] = &mesh.normals[v[c]].x;
    }
    if (instance != nullptr || mesh.moves) {
      move_normals(rows, k, mesh_at(mesh, instance, time), v);
    }
  }
}

template <std::size_t N>
void add_maps(MapRows<N>& rows, std::size_t k, const LaneMesh& mesh, const RawHit& hit,
              const PlacedInstance* instance, float time) {
  rows.maps[k] = mesh.maps;
  const std::uint32_t* v = mesh.indices + 3 * std::size_t{hit.primitive};
  for (std::size_t c = 0; c < 3 && mesh.uv != nullptr; ++c) {
    rows.u[c][k] = mesh.uv[v[c]].x;
    rows.v[c][k] = mesh.uv[v[c]].y;
  }
  for (std::size_t c = 0; c < 3 && mesh.tangents != nullptr; ++c) {
    const Vec4& t = mesh.tangents[v[c]];
    rows.tangents[c][k] = &t.x;
    if (instance != nullptr || mesh.moves) {
      const Vec3 moved = mesh_at(mesh, instance, time).vector({t.x, t.y, t.z}, v);
      rows.turned[c][k] = {moved.x, moved.y, moved.z, t.w};
      rows.tangents[c][k] = &rows.turned[c][k].x;
    }
  }
}

template <std::size_t N>
[[gnu::always_inline]] inline FaceOf<Floats<N>> face(const FaceRows<N>& rows, Vec3s<N> origin,
                                                     Vec3s<N> direction) {
  Corners<Vec3s<N>> p;
  Floats<N> behind;
  for (std::size_t c = 0; c < 3; ++c) {
    p[c] = gather(rows.positions[c], behind);
  }
  return face_at(p, origin, direction, load<N>(rows.mirror), load<N>(rows.spread),
                 load<N>(rows.place_m));
}

template <std::size_t N>
[[gnu::flatten]] TriangleLanes<N> meet_plain(const SegmentLanes<N>& segments,
                                             const FaceRows<N>& rows, LaneHits<N>& out) {
  const Floats<N> zero(0);
  const Floats<N> one(1);
  const Vec3s<N> wo = -segments.direction;
  TriangleLanes<N> triangles = {face(rows, segments.origin, segments.direction), {}, {}};
  const FaceOf<Floats<N>>& at = triangles.face;
  const Vec3s<N> geometric = at.geometric;
  out.position = at.position;
  const Floats<N> cos_front = dot(geometric, wo);
  const Mask<N> front = cos_front >= zero;
  const Floats<N> side = select(front, one, Floats<N>(-1));
  SurfaceLanes<N>& s = out.surface;
  s.normal_geometric = geometric * side;
  s.horizon = s.normal_geometric;
  s.origin = out.position;
  s.error_m = at.error_m;
  Vec3s<N> shading = geometric;
  if (rows.smooth != 0) {
    Corners<Vec3s<N>> corner;
    Floats<N> behind;
    for (std::size_t c = 0; c < 3; ++c) {
      corner[c] = gather(rows.normals[c], behind);
      if (rows.moved != 0) {
        corner[c] = select(Mask<N>::of(rows.moved), normalize_or(corner[c], geometric), corner[c]);
      }
    }
    const Mask<N> is_smooth = Mask<N>::of(rows.smooth);
    shading = select(is_smooth, normalize_or(blend(corner, at.b), geometric), geometric);
    const Mask<N> allowed =
        (front & Mask<N>::of(rows.round[0])) | (~front & Mask<N>::of(rows.round[1]));
    if (allowed.any()) {
      leave_bulge(allowed, bulge(at.p, corner, at.b, side), shading, geometric, side, wo, s.horizon,
                  s.origin);
    }
  }
  s.normal = facing(shading * side, wo);
  Floats<N> c[4][4];
  transpose_rows(rows.material, c);
  s.base_color = {c[0][0], c[0][1], c[0][2]};
  s.metallic = c[0][3];
  s.roughness = c[1][0];
  s.alpha = c[1][1];
  s.f0 = {c[1][2], c[1][3], c[2][0]};
  s.f90 = c[2][1];
  const Mask<N> emits = (cos_front > zero) | Mask<N>::of(rows.emits_from_both_sides);
  out.emitted = {select(emits, c[2][2], zero), select(emits, c[2][3], zero),
                 select(emits, c[3][0], zero)};
  out.light = load<N>(rows.light);
  out.distance_m = length(out.position - segments.origin);
  out.cone_width_m = segments.cone_width_m + segments.cone_spread_rad * out.distance_m;
  triangles.shading = shading;
  triangles.side = side;
  return triangles;
}

}  // namespace

bool lanes_support(const SceneData& scene, const Solid& solid) noexcept {
  const Material& m = *solid.material;
  // Lanes know no diffuse transmission of solids: a path would come and go with each segment.
  return !scene.has_solid_holes && solid.kind != SolidKind::kCavity && !m.medium.scatters() &&
         !(m.factors.dispersion > 0) && m.plain.transmission > 0;
}

LaneSurfaces::~LaneSurfaces() = default;

LaneSurfaces::LaneSurfaces(const SceneData& scene, bool has_solids) : scene_(scene) {
  for (const Material& m : scene.materials) {
    const BsdfParameters& b = m.plain;
    const Rgb e = m.is_emissive && !shines_alone(m) ? m.factors.emissive : Rgb{};
    maps_.push_back(LaneMaps(m));
    set_layers(m, UntexturedPoint(), layers_.emplace_back());
    materials_.push_back({{b.base_color.r, b.base_color.g, b.base_color.b, b.metallic,  //
                           b.roughness, b.alpha_x, b.f0.r, b.f0.g,                      //
                           b.f0.b, b.f90, e.r, e.g, e.b, 0, 0, 0}});
  }
  for (const PlacedMesh& placed : scene.placed) {
    const MeshData& mesh = scene.meshes[placed.mesh];
    const Material& m = scene.materials[mesh.material];
    const bool is_brushed = m.factors.anisotropy > 0;
    const bool is_plain = !m.has_texture && mesh.colors.empty() && !is_brushed;
    const bool maps = is_mapped(m) && mesh.colors.empty() && !is_brushed &&
                      !turns_tangents(mesh, m.normal) && !turns_tangents(mesh, m.clearcoat_normal);
    const bool is_wall = m.transmits && !m.is_volume;
    const bool has_film = m.factors.iridescence > 0;
    const bool has_layers = m.factors.clearcoat > 0 || !is_black(m.factors.sheen_color);
    const bool is_solid = placed.solid != kNoSolid;
    const bool is_supported =
        !is_unsupported(m, is_solid) &&
        (!is_solid || (has_solids && lanes_support(scene, scene.solids[placed.solid])));
    const LaneMesh::Kind kind = !is_supported ? LaneMesh::Kind::kUnsupported
                                : is_plain    ? LaneMesh::Kind::kPlain
                                : maps        ? LaneMesh::Kind::kMapped
                                              : LaneMesh::Kind::kTextured;
    const auto* uv =
        maps ? &mesh.uv[static_cast<std::size_t>(first_mapped(m)->description.uv_set)] : nullptr;
    const auto data = [](const auto& values) { return values.empty() ? nullptr : values.data(); };
    placed_.push_back({mesh.positions.data(),
                       data(mesh.normals),
                       m.transmits ? nullptr : data(mesh.round_sides),
                       mesh.indices.data(),
                       &materials_[mesh.material],
                       maps ? &maps_[mesh.material] : nullptr,
                       maps ? data(*uv) : nullptr,
                       data(mesh.tangents),
                       placed.first_light,
                       kind,
                       &mesh,
                       !mesh.later.empty(),
                       &m,
                       &layers_[mesh.material],
                       same_coverage(m, has_alpha_map(m) || !mesh.colors.empty()),
                       m.is_clear,
                       m.factors.emits_from_both_sides(),
                       shines_alone(m),
                       has_layers,
                       is_wall,
                       has_film,
                       has_layers || is_wall || has_film || is_solid,
                       placed.solid,
                       is_solid && scene.solids[placed.solid].shares_space});
    has_layers_ = has_layers_ || has_layers;
    has_kinds_ = has_kinds_ || placed_.back().has_extras != placed_.front().has_extras;
  }
}

template <std::size_t N>
void LaneSurfaces::meet(const SegmentLanes<N>& segments, const RawHit (&hits)[N], unsigned on,
                        LaneHits<N>& out) const {
  FaceRows<N> rows;
  unsigned plain = 0;
  unsigned mapped = 0;
  unsigned textured = 0;
  unsigned extras = 0;
  unsigned front = 0;
  unsigned single = 0;
  out.unsupported = 0;
  out.films.on = 0;
  for (unsigned rest = on; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    const unsigned bit = 1U << k;
    const RawHit& hit = hits[k];
    const LaneMesh& mesh = entry_of(hit);
    if (mesh.kind == LaneMesh::Kind::kUnsupported) {
      out.unsupported |= bit;
    } else if (mesh.kind == LaneMesh::Kind::kTextured || (mesh.shines_alone && shines(mesh, hit))) {
      textured |= bit;
    } else {
      (mesh.kind == LaneMesh::Kind::kPlain ? plain : mapped) |= bit;
      extras |= mesh.has_extras ? bit : 0U;
      add_triangle(rows, k, mesh, hit, scene_.instance_of(hit), segments.time.v[k]);
    }
  }
  if ((plain | mapped) == 0) {
    out.surface = SurfaceLanes<N>();
  } else {
    rows.complete(plain | mapped);
    const TriangleLanes<N> triangles = meet_plain(segments, rows, out);
    if (extras != 0) {
      front = (triangles.side > Floats<N>(0)).bits();
      single = load_extras(hits, extras, triangles.face, out);
    }
    if (mapped != 0) {
      MapRows<N> maps;
      for (unsigned rest = mapped; rest != 0; rest &= rest - 1) {
        const auto k = static_cast<std::size_t>(std::countr_zero(rest));
        add_maps(maps, k, entry_of(hits[k]), hits[k], scene_.instance_of(hits[k]),
                 segments.time.v[k]);
      }
      textured |= mapped & ~apply_maps(segments, triangles, maps, Mask<N>::of(mapped), out).bits();
    }
  }
  if (has_layers_) {
    finish(out);
  }
  for (; textured != 0; textured &= textured - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(textured));
    const bool is_front = meet_textured(segments, hits[k], k, out);
    front = (front & ~(1U << k)) | (is_front ? 1U << k : 0U);
  }
  if (out.brushed != 0) {
    out.brush.alpha_x = select(Mask<N>::of(out.brushed), out.brush.alpha_x, out.surface.alpha);
  }
  if (out.solid != 0) {
    cross_solids(segments, hits, front, single, out);
  }
}

/// Loads the factors beyond SurfaceLanes in the lanes of `on`, and the coats' normals without their
/// textures, in world space. Returns the lanes that are known to be on a single face of a solid.
template <std::size_t N>
[[gnu::noinline]] unsigned LaneSurfaces::load_extras(const RawHit (&hits)[N], unsigned on,
                                                     const FaceOf<Floats<N>>& face,
                                                     LaneHits<N>& out) const {
  unsigned single = 0;
  for (; on != 0; on &= on - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(on));
    const LaneMesh& mesh = entry_of(hits[k]);
    if (mesh.has_layers && out.layered == 0) {
      out.layers = LayerLanes<N>();
      out.layers.clearcoat_normal = out.surface.normal;
    }
    set_extras(mesh, k, mesh.material->plain, *mesh.layers, out);
    if (mesh.solid != kNoSolid && scene_.is_single_face_within(hits[k], out.position.lane(k))) {
      single |= 1U << k;
    }
  }
  return single == 0
             ? 0
             : single & is_within(face.p, face.n, out.position, scene_.edge_margin_m).bits();
}

/// Finds the media beyond the boundaries of solids. What is not a single face between a solid and
/// the outside becomes unsupported. front: bits of the lanes that see the front of the triangle.
/// single: of those known to be on a single face.
template <std::size_t N>
[[gnu::noinline]] void LaneSurfaces::cross_solids(const SegmentLanes<N>& segments,
                                                  const RawHit (&hits)[N], unsigned front,
                                                  unsigned single, LaneHits<N>& out) const {
  const Vec3s<N>& ng = out.surface.normal_geometric;
  const Vec3s<N> of_front = select(Mask<N>::of(front), ng, -ng);
  const unsigned meets_front = (dot(of_front, segments.direction) < Floats<N>(0)).bits();
  for (unsigned rest = out.solid; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    const std::uint32_t id = entry_of(hits[k]).solid;
    const Solid& solid = scene_.solids[id];
    const auto number = static_cast<std::int32_t>(id) + 1;
    const bool inwards = is_inwards(solid, (meets_front >> k & 1U) != 0);
    if (segments.medium.v[k] != (inwards ? 0 : number)) {
      out.unsupported |= 1U << k;
      continue;
    }
    out.solids.ior.v[k] = solid.ior;
    out.solids.inside.v[k] = inwards ? 0 : -1;
    out.beyond.v[k] = inwards ? number : 0;
    if ((single >> k & 1U) != 0) {
      continue;
    }
    const Ray ray = {.origin = segments.origin.lane(k),
                     .direction = segments.direction.lane(k),
                     .time = segments.time.v[k]};
    SurfacePoint point;
    point.position = out.position.lane(k);
    point.normal_geometric = of_front.lane(k);
    point.error_m = out.surface.error_m.v[k];
    MediumStack media;
    if (!inwards) {
      media.enter(solid);
    }
    const FacesAt faces = faces_at(scene_, hits[k], point, ray, media);
    if (faces.instead || faces.beyond.size() != (inwards ? 1U : 0U)) {
      out.unsupported |= 1U << k;
    }
    out.surface.error_m.v[k] = faces.error_m;
  }
}

[[gnu::flatten]] Floats<8> LaneSurfaces::go_behind(TracedPacket& packet, unsigned on) const {
  FaceRows<8> rows;
  for (unsigned rest = on; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    const RawHit hit = packet.hit(k);
    const LaneMesh& mesh = entry_of(hit);
    rows.material[k] = kNothing;
    add_face(rows, k, mesh, hit, scene_.instance_of(hit), packet.rays.time[k]);
  }
  rows.complete(on);
  RayPacket& rays = packet.rays;
  const Vec3s<8> origin = {load<8>(rays.origin_x), load<8>(rays.origin_y), load<8>(rays.origin_z)};
  const Vec3s<8> direction = {load<8>(rays.direction_x), load<8>(rays.direction_y),
                              load<8>(rays.direction_z)};
  const FaceOf<Floats<8>> at = face(rows, origin, direction);
  const Vec3s<8> behind = origin_behind(at.position, at.geometric, at.error_m, direction);
  const Mask<8> moved = Mask<8>::of(on);
  store(rays.origin_x, select(moved, behind.x, origin.x));
  store(rays.origin_y, select(moved, behind.y, origin.y));
  store(rays.origin_z, select(moved, behind.z, origin.z));
  return length(at.position - origin);
}

/// Returns whether emission that is evaluated lane by lane is not black at the hit.
bool LaneSurfaces::shines(const LaneMesh& mesh, const RawHit& hit) const {
  return mesh.first_light == kNoLight ||
         !is_black(scene_.triangle_lights[mesh.first_light + hit.primitive].radiance);
}

/// Returns whether the front is hit.
template <std::size_t N>
bool LaneSurfaces::meet_textured(const SegmentLanes<N>& segments, const RawHit& hit, std::size_t k,
                                 LaneHits<N>& out) const {
  const Ray ray = {.origin = segments.origin.lane(k),
                   .direction = segments.direction.lane(k),
                   .time = segments.time.v[k]};
  const SurfacePoint point = scene_.surface_point(hit, ray);
  const Material& material = scene_.materials[point.material];
  const Vec3 wo = -ray.direction;
  const float distance = length(point.position - ray.origin);
  const float cone = segments.cone_width_m.v[k] + segments.cone_spread_rad.v[k] * distance;
  Shading shading;
  shade(material, point, wo, {cone, segments.is_sharp.v[k] != 0}, shading);
  // Does not read textures for triangles that emit nowhere.
  const bool is_dark =
      point.light != kNoLight && is_black(scene_.triangle_lights[point.light].radiance);
  const Rgb light = is_dark ? Rgb{} : emitted(material, point, wo);
  const BsdfParameters& b = shading.bsdf;
  SurfaceLanes<N>& s = out.surface;
  s.normal_geometric.set(k, shading.normal_geometric);
  s.normal.set(k, shading.frame.n);
  s.horizon.set(k, shading.horizon);
  s.origin.set(k, shading.origin);
  s.error_m.v[k] = point.error_m;
  set_lane(s, k, b);
  s.f0.set(k, {b.f0.r, b.f0.g, b.f0.b});
  s.f90.v[k] = b.f90;
  if (material.factors.anisotropy > 0) {
    out.brushed |= 1U << k;
    out.brush.alpha_x.v[k] = b.alpha_x;
    out.brush.along.set(k, shading.frame.s);
  }
  set_extras(entry_of(hit), k, b, shading.layers, out);
  if (entry_of(hit).has_layers) {
    out.layers.clearcoat_normal.set(k, shading.layers.clearcoat_normal);
  }
  out.position.set(k, point.position);
  out.emitted.set(k, {light.r, light.g, light.b});
  out.light.v[k] = static_cast<std::int32_t>(point.light);
  out.distance_m.v[k] = distance;
  out.cone_width_m.v[k] = cone;
  return shading.front;
}

template void LaneSurfaces::meet(const SegmentLanes<8>&, const RawHit (&)[8], unsigned,
                                 LaneHits<8>&) const;
template void LaneSurfaces::meet(const SegmentLanes<1>&, const RawHit (&)[1], unsigned,
                                 LaneHits<1>&) const;

}  // namespace core
