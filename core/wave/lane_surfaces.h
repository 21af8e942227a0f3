/// Hits in lanes: SceneData::surface_point() and shade() for N hits at once.
///
/// Plain surfaces (no texture, no vertex colour) are evaluated in SIMD, as are mapped ones, whose
/// textures share coordinates and transform; other textured and brushed surfaces are evaluated lane
/// by lane.
/// All others are `unsupported`: the lanes cannot evaluate them.
#pragma once

#include <bit>
#include <vector>

#include "core/materials/shade.h"
#include "core/scene/scene_data.h"
#include "core/wave/lane_bsdf.h"
#include "core/wave/wave.h"

namespace core {

/// The segments that hit a surface.
template <std::size_t N>
struct SegmentLanes {
  Vec3s<N> origin;
  Vec3s<N> direction;
  Floats<N> cone_width_m;  ///< at the origin
  Floats<N> cone_spread_rad;
  Ints<N> is_sharp;
  Floats<N> time{0};  ///< while the shutter is open
  Ints<N> medium;     ///< as in PathMembers
};

/// The surfaces they hit.
template <std::size_t N>
struct LaneHits {
  SurfaceLanes<N> surface;
  Vec3s<N> position;
  Vec3s<N> emitted;  ///< towards the segment's origin
  Floats<N> distance_m;
  Floats<N> cone_width_m;    ///< at the hit
  Ints<N> light;             ///< SurfacePoint::light
  unsigned unsupported = 0;  ///< bits of the lanes whose surfaces are unsupported
  unsigned layered = 0;      ///< those with clearcoat or sheen
  LayerLanes<N> layers;      ///< valid if any is layered; in the frame of the surface's normal
  unsigned solid = 0;        ///< those on the boundary of a solid; valid if not 0:
  SolidLanes<N> solids;
  Ints<N> beyond;     ///< the medium on the other side
  unsigned wall = 0;  ///< those that transmit without a solid; valid if not 0:
  WallLanes<N> walls;
  unsigned brushed = 0;  ///< those that are brushed; valid if not 0:
  BrushLanes<N> brush;
  FilmLanes<N> films;  ///< none if films.on is 0
};

/// Returns eta_scale of a path that came into the solid by refraction.
inline float eta_scale_within(const Solid& solid) noexcept { return square(solid.ior); }
/// Returns whether lanes support paths in this solid and through its boundary.
bool lanes_support(const SceneData& scene, const Solid& solid) noexcept;

struct TracedPacket;
struct LaneMaps;

/// A mesh that rays can hit, through an instance or not.
struct LaneMesh {
  enum class Kind { kPlain, kMapped, kTextured, kUnsupported };
  /// A material without its textures: base colour, metallic, roughness, alpha, f0, f90, emission.
  struct alignas(64) Row {
    float at[16];
  };
  const Vec3* positions;
  const Vec3* normals;              ///< null if absent
  const std::uint8_t* round_sides;  ///< null if none
  const std::uint32_t* indices;
  const Row* row;
  const LaneMaps* maps;  ///< null unless mapped
  const Vec2* uv;        ///< texture coordinates that the maps use; null if absent
  const Vec4* tangents;  ///< null if absent
  std::uint32_t first_light;
  Kind kind;
  const MeshData* mesh;
  bool moves;
  const Material* material;
  const BsdfLayers* layers;  ///< without their textures
  float coverage;            ///< everywhere; negative: it may vary
  bool is_clear;
  bool emits_from_both_sides;
  bool shines_alone;  ///< emission is evaluated lane by lane
  bool has_layers;    ///< clearcoat or sheen
  bool is_wall;       ///< transmits without a solid
  bool has_film;
  bool has_extras;      ///< any of these, or a solid
  std::uint32_t solid;  ///< PlacedMesh::solid
  bool shares_space;    ///< as of the solid
};

class LaneSurfaces {
 public:
  /// has_solids: whether solids are supported.
  LaneSurfaces(const SceneData& scene, bool has_solids);
  ~LaneSurfaces();

  /// Evaluates the lanes in `on`; the results of the others are unspecified. hits: of lane 0,
  /// followed by the others.
  template <std::size_t N>
  void meet(const SegmentLanes<N>& segments, const RawHit (&hits)[N], unsigned on,
            LaneHits<N>& out) const;
  /// Returns the coverage of a hit: below 1 at holes.
  float coverage(const RawHit& hit, const Ray& ray) const {
    const float same = entry_of(hit).coverage;
    return same < 0 ? scene_.coverage(hit, ray) : same;
  }
  /// Moves the origins of rays `on` behind their hits, as ray_behind(); returns the distances.
  Floats<8> go_behind(TracedPacket& packet, unsigned on) const;
  /// Returns whether there are surfaces with layers that lanes compute apart, and others.
  bool has_kinds() const { return has_kinds_; }
  /// The hits `on`, from `first` on, at surfaces with layers that lanes compute apart.
  template <std::size_t N>
  unsigned with_extras(const WaveHits& hits, std::size_t first, unsigned on) const {
    unsigned out = 0;
    for (; on != 0; on &= on - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(on));
      const LaneMesh& mesh = entry_of({0, hits.instance.at[first + k], hits.geometry.at[first + k],
                                       hits.primitive.at[first + k]});
      out |= (mesh.has_extras ? 1U : 0U) << k;
    }
    return out;
  }
  /// Returns whether a hit lets no light through, whatever is around it.
  bool blocks(const RawHit& hit, const Ray& ray) const {
    const LaneMesh& mesh = entry_of(hit);
    return !mesh.is_clear && !mesh.shares_space && !(coverage(hit, ray) < 1);
  }

 private:
  const LaneMesh& entry_of(const RawHit& hit) const {
    const std::size_t first =
        hit.instance == kNoInstance ? 0 : scene_.instances[hit.instance].first_placed;
    return placed_[first + hit.geometry];
  }
  bool shines(const LaneMesh& mesh, const RawHit& hit) const;
  template <std::size_t N>
  unsigned load_extras(const RawHit (&hits)[N], unsigned on, const FaceOf<Floats<N>>& face,
                       LaneHits<N>& out) const;
  template <std::size_t N>
  void cross_solids(const SegmentLanes<N>& segments, const RawHit (&hits)[N], unsigned front,
                    unsigned single, LaneHits<N>& out) const;
  template <std::size_t N>
  bool meet_textured(const SegmentLanes<N>& segments, const RawHit& hit, std::size_t k,
                     LaneHits<N>& out) const;

  const SceneData& scene_;
  std::vector<LaneMesh::Row> materials_;
  std::vector<BsdfLayers> layers_;  ///< as SceneData::materials
  std::vector<LaneMaps> maps_;      ///< as SceneData::materials
  std::vector<LaneMesh> placed_;    ///< as SceneData::placed
  bool has_layers_ = false;         ///< some surface has clearcoat or sheen
  bool has_kinds_ = false;
};

}  // namespace core
