/// Photons that merge with camera subpaths (vcm).
#pragma once

#include <numbers>
#include <vector>

#include "core/integrators/bidirectional/bdpt_vertex.h"
#include "core/integrators/integrator.h"
#include "core/integrators/maps/photon_pass.h"
#include "core/integrators/maps/photon_rules.h"
#include "core/integrators/registry.h"

namespace core {

/// A vertex of a light subpath on a surface.
struct MergedPhoton {
  explicit MergedPhoton(const Vertex& at)
      : position(at.position()),
        beta(at.beta),
        wi_world(at.wo_world()),
        normal(at.surface.point.normal_geometric),
        sums(at.sums),
        light(at.light),
        surfaces(static_cast<std::uint16_t>(at.surfaces)),
        in_media(static_cast<std::uint16_t>(at.in_media)),
        is_clear(at.is_clear) {}
  MergedPhoton() = default;

  Vec3 position;             ///< world [m]
  Rgb beta;                  ///< as if it were the only photon [W]
  PackedDirection wi_world;  ///< direction it came from, away from the surface
  PackedDirection normal;    ///< geometric
  PartialSums sums;
  std::uint32_t light = kNoLight;
  std::uint16_t surfaces = 0;  ///< as those of the vertex
  std::uint16_t in_media = 0;
  bool is_clear = false;
};

static_assert(sizeof(MergedPhoton) == kMergedPhotonBytes);

/// Number and disks of the photons of a job.
class Merging {
 public:
  explicit Merging(const IntegratorInput& input)
      : is_on(integrator_has_prepass(input.settings)),
        paths(photon_paths(input.settings)),
        alpha_(input.settings.photons.alpha) {
    if (!is_on) {
      return;
    }
    const float set_m = input.settings.photons.radius_m;
    first_radius_m_ =
        set_m > 0 ? set_m : usual_photon_radius_m(input.scene, *input.camera, input.settings.film);
    for (int pass = 0; pass < kTabulated; ++pass) {
      shrunk_.push_back(sppm_radius(alpha_, pass));
    }
  }

  /// pass: sample of a replicate.
  float radius_m(int pass) const noexcept {
    return first_radius_m_ * static_cast<float>(pass < kTabulated
                                                    ? shrunk_[static_cast<std::size_t>(pass)]
                                                    : sppm_radius(alpha_, pass));
  }
  /// Number of light paths that fall into a disk, for a density of 1 per area.
  double in_disk(float radius_m) const noexcept {
    return std::numbers::pi * squared(static_cast<double>(radius_m)) * paths;
  }
  /// PartialSums::merged in a pass.
  double merged(int pass) const noexcept { return is_on ? squared(in_disk(radius_m(pass))) : 0; }

  const bool is_on;
  const int paths;

 private:
  static constexpr int kTabulated = 1024;  // light paths ask for each sample's

  float alpha_;
  float first_radius_m_ = 0;
  std::vector<double> shrunk_;
};

}  // namespace core
