/// is_sane: whether a renderer can have made a pixel that was read from a file or a message.
#pragma once

#include <cmath>
#include <cstdint>

#include "core/film/film.h"

namespace core {

inline bool is_sane(const ReplicatePixel& p) {
  const bool finite = std::isfinite(p.mean_r) && std::isfinite(p.mean_g) &&
                      std::isfinite(p.mean_b) && std::isfinite(p.mean_alpha) &&
                      std::isfinite(p.m2_luminance);
  const bool empty =
      p.mean_r == 0 && p.mean_g == 0 && p.mean_b == 0 && p.mean_alpha == 0 && p.m2_luminance == 0;
  return finite && (p.count > 0 || empty);
}

inline bool is_sane(const AuxPixel& p, std::uint64_t samples) {
  const Vec3 n = p.normal_world;
  return is_finite(p.albedo) && std::isfinite(n.x) && std::isfinite(n.y) && std::isfinite(n.z) &&
         std::isfinite(p.depth_m) && p.hits <= samples;
}

inline bool is_sane(const LabelPixel& p) {
  return is_finite(p.position) && std::isfinite(p.uv.x) && std::isfinite(p.uv.y) &&
         !std::isinf(p.motion.x) && !std::isinf(p.motion.y);
}

}  // namespace core
