#include "core/bsdf/anisotropic_albedo.h"

#include <algorithm>
#include <cmath>

namespace core {
namespace {

/// A position between two nodes of an axis; x in [0,1].
struct Between {
  int node;
  float share;

  Between(float x, int nodes) noexcept {
    const float at = std::clamp(x, 0.0F, 1.0F) * static_cast<float>(nodes - 1);
    node = std::min(static_cast<int>(at), nodes - 2);
    share = at - static_cast<float>(node);
  }
};

template <typename At>
SpecularAlbedo between(Between x, const At& at) noexcept {
  const SpecularAlbedo low = at(x.node);
  const SpecularAlbedo high = at(x.node + 1);
  return {low.e + (high.e - low.e) * x.share, low.e5 + (high.e5 - low.e5) * x.share};
}

}  // namespace

Anisotropy::Anisotropy(float alpha_x, float alpha_y) noexcept : is_y_wide(alpha_y > alpha_x) {
  const float narrow = std::min(alpha_x, alpha_y);
  const float wide = std::max(alpha_x, alpha_y);
  roughness = std::sqrt(narrow);
  strength = narrow < 1 ? std::sqrt((wide - narrow) / (1 - narrow)) : 0.0F;
}

SpecularAlbedo Anisotropy::albedo(Vec3 w) const noexcept {
  const float sine = std::hypot(w.x, w.y);
  const float cos_phi = sine > 0 ? std::fabs(is_y_wide ? w.y : w.x) / sine : 1.0F;
  const Between at_mu(std::sqrt(std::fabs(w.z)), kAnisotropicNodes[3]);
  const Between at_phi(std::sqrt(cos_phi), kAnisotropicNodes[2]);
  const Between at_strength(strength, kAnisotropicNodes[1]);
  return between(Between(roughness, kAnisotropicNodes[0]), [&](int r) {
    return between(at_strength, [&](int s) {
      const auto& lobe = kAnisotropicAlbedoTables.at[r][s];
      return between(at_phi,
                     [&](int p) { return between(at_mu, [&](int m) { return lobe[p][m]; }); });
    });
  });
}

SpecularAlbedo Anisotropy::average() const noexcept {
  return between(Between(roughness, kAnisotropicNodes[0]), [&](int r) {
    return between(Between(strength, kAnisotropicNodes[1]),
                   [&](int s) { return kAnisotropicAlbedoTables.average[r][s]; });
  });
}

}  // namespace core
