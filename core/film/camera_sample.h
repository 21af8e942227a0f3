/// camera_sample: where a sample's camera ray passes the film and the lens.
#pragma once

#include "core/film/filter.h"
#include "core/samplers/dimensions.h"
#include "core/samplers/path_sampler.h"

namespace core {

struct CameraSample {
  Vec2 film_px;      ///< a point of the full film
  Vec2 lens;         ///< uniform in [0,1)^2
  float weight = 1;  ///< of the radiance, in the film's filter
};

/// Starts the sampler for sample `s` of pixel (x, y) and draws the point of the film.
inline CameraSample start_camera_sample(PathSampler& sampler, const FilterSampler& filter, int x,
                                        int y, int s) noexcept {
  sampler.start(x, y, s);
  const Vec4 u = sampler.get_4d(kCameraGroup);
  const FilterSampler::Offset at = filter.sample({u.x, u.y});
  return {{static_cast<float>(x) + 0.5F + at.offset_px.x,
           static_cast<float>(y) + 0.5F + at.offset_px.y},
          {u.z, u.w},
          at.weight};
}

}  // namespace core
