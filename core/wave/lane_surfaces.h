/// Hits in lanes: SceneData::surface_point() and shade() for N hits at once.
///
/// Plain surfaces (no texture, no vertex colour) are found side by side, and mapped ones, whose
/// textures of colour, metallic-roughness and normal all read the same places; others with textures
/// lane by lane. The rest is foreign: the lanes know nothing of it.
#pragma once

#include <vector>

#include "core/materials/shade.h"
#include "core/scene/scene_data.h"
#include "core/wave/lane_bsdf.h"

namespace core {

/// The segments that met something.
template <std::size_t N>
struct SegmentLanes {
  Vec3s<N> origin;
  Vec3s<N> direction;
  Floats<N> cone_width_m;  ///< at the origin
  Floats<N> cone_spread_rad;
  Ints<N> is_sharp;
};

/// What they met.
template <std::size_t N>
struct MetLanes {
  SurfaceLanes<N> surface;
  Vec3s<N> position;
  Vec3s<N> emitted;  ///< towards the segment's origin
  Floats<N> distance_m;
  Floats<N> cone_width_m;  ///< here
  Ints<N> light;           ///< SurfacePoint::light
  unsigned foreign = 0;    ///< bits of the lanes whose surfaces are
};

struct LaneMaps;
template <std::size_t N>
struct MapRows;
template <std::size_t N>
struct TriangleLanes;

class LaneSurfaces {
 public:
  explicit LaneSurfaces(const SceneData& scene);
  ~LaneSurfaces();

  /// Of the lanes in `on`; in the others anything. hits: of lane 0, the others follow.
  template <std::size_t N>
  void meet(const SegmentLanes<N>& segments, const RawHit (&hits)[N], unsigned on,
            MetLanes<N>& out) const;

 private:
  enum class Kind { kPlain, kMapped, kTextured, kForeign };
  /// A material without its textures: base colour, metallic, roughness, alpha, f0, f90, emission.
  struct alignas(64) Row {
    float at[16];
  };
  /// A placed mesh.
  struct Entry {
    const Vec3* positions;
    const Vec3* normals;  ///< null: none
    const std::uint32_t* indices;
    const Row* row;
    const LaneMaps* maps;  ///< null unless mapped
    const Vec2* uv;        ///< of the set that these read; null: none
    const Vec4* tangents;  ///< null: none
    std::uint32_t first_light;
    Kind kind;
    bool may_be_hole;
    bool is_double_sided;
    bool shines_by_texture;
  };
  /// Where the lanes' triangles and materials lie, as rows of floats.
  template <std::size_t N>
  struct Rows;

  bool shines(const Entry& mesh, const RawHit& hit) const;
  template <std::size_t N>
  static void add_triangle(Rows<N>& rows, std::size_t k, const Entry& mesh, const RawHit& hit,
                           const Transform* to_world);
  template <std::size_t N>
  static void add_maps(MapRows<N>& rows, std::size_t k, const Entry& mesh, const RawHit& hit,
                       const Transform* to_world);
  template <std::size_t N>
  static TriangleLanes<N> meet_plain(const SegmentLanes<N>& segments, const Rows<N>& rows,
                                     MetLanes<N>& out);
  template <std::size_t N>
  void meet_textured(const SegmentLanes<N>& segments, const RawHit& hit, std::size_t k,
                     MetLanes<N>& out) const;

  const SceneData& scene_;
  std::vector<Row> materials_;
  std::vector<LaneMaps> maps_;  ///< as SceneData::materials
  std::vector<Entry> placed_;   ///< as SceneData::placed
};

}  // namespace core
