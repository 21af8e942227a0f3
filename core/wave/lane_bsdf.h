/// Bsdf in lanes: the surfaces that core/wave/lane_surfaces.h finds, for BsdfOf.
#pragma once

#include "core/bsdf/bsdf_of.h"

namespace core {

/// The result of shading: Shading and BsdfParameters of N points.
template <std::size_t N>
struct SurfaceLanes {
  Vec3s<N> normal_geometric;  ///< on the viewer's side, like the next two
  Vec3s<N> normal;
  Vec3s<N> horizon;
  Vec3s<N> origin;
  Floats<N> error_m;  ///< SurfacePoint::error_m
  Vec3s<N> base_color;
  Floats<N> metallic, roughness;
  Floats<N> alpha;  ///< alpha_y
  Vec3s<N> f0;
  Floats<N> f90;
};

/// The members of BsdfLayers that lanes have; 0 where a surface has no such layer.
template <std::size_t N>
struct LayerLanes {
  Floats<N> clearcoat;
  Floats<N> clearcoat_roughness;
  Vec3s<N> clearcoat_normal;
  Vec3s<N> sheen_color;
  Floats<N> sheen_roughness;
};

/// The members of BsdfParameters of the boundaries of solids.
template <std::size_t N>
struct SolidLanes {
  Floats<N> transmission;  ///< 0 where there is no solid
  Vec3s<N> specular_color;
  Floats<N> ior;
  Mask<N> inside;
};

template <std::size_t N>
using WallLanes = WallOf<Floats<N>>;

/// Brushed surfaces.
template <std::size_t N>
struct BrushLanes {
  Floats<N> alpha_x;  ///< elsewhere that of SurfaceLanes
  Vec3s<N> along;     ///< Frame::s of the shading frame, world; unspecified elsewhere
};

/// Films; only those of `on` are valid.
template <std::size_t N>
struct FilmLanes {
  unsigned on;
  Floats<N> weight, ior, thickness_nm;
  Vec3s<N> wavelengths_nm;

  ThinFilmOf<Floats<N>> film() const {
    return {true, select(Mask<N>::of(on), weight, Floats<N>(0)), ior, thickness_nm, wavelengths_nm};
  }
};

/// What some lanes have beyond SurfaceLanes; null if no lane has any.
template <std::size_t N>
struct ExtraLanes {
  const LayerLanes<N>* layers = nullptr;
  const SolidLanes<N>* solids = nullptr;
  const WallLanes<N>* walls = nullptr;
  const BrushLanes<N>* brush = nullptr;
  const FilmLanes<N>* films = nullptr;
};

template <std::size_t N>
class BsdfLanes : public BsdfOf<Floats<N>> {
 public:
  /// As of BsdfOf.
  BsdfLanes(const SurfaceLanes<N>& s, Vec3s<N> wo, Vec3s<N> ng, const ExtraLanes<N>& extra = {})
      : BsdfOf<Floats<N>>(s, {extra.brush == nullptr ? s.alpha : extra.brush->alpha_x, s.alpha}, wo,
                          ng, extra) {}
};

}  // namespace core
