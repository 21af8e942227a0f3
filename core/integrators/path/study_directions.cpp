#include "core/integrators/path/study_directions.h"

#include "core/math/numbers.h"
#include "core/sampling/warp.h"

namespace core {

BsdfSample sample_study_direction(const Bsdf& bsdf, bool cosine, Vec4 u) noexcept {
  const float prob_delta = bsdf.prob_delta();
  if (u.w < prob_delta) {
    BsdfSample s = bsdf.sample_delta(u.x, {u.y, u.z});
    s.weight = s.weight / prob_delta;
    return s;
  }
  BsdfSample s;
  s.wi_local = cosine ? cosine_hemisphere({u.y, u.z}) : uniform_hemisphere({u.y, u.z});
  float pdf =
      (1 - prob_delta) * (cosine ? cosine_hemisphere_pdf_solid_angle(s.wi_local.z) : 0.5F * kInvPi);
  if (bsdf.transmits()) {
    pdf *= 0.5F;
    if (u.x < 0.5F) {
      s.wi_local.z = -s.wi_local.z;
    }
  }
  const BsdfEval f = bsdf.evaluate(s.wi_local);
  if (pdf > 0) {
    s.weight = f.value_cos / pdf;
    s.pdf_solid_angle = pdf;
  }
  return s;
}

}  // namespace core
