/// PhotonPass: the photons of one sample of the pixels, traced in parts.
#pragma once

#include <algorithm>
#include <vector>

#include "core/integrators/maps/photon_map.h"
#include "core/integrators/prepass.h"
#include "core/samplers/path_sampler.h"
#include "core/samplers/streams.h"
#include "core/settings/settings.h"

namespace core {

template <typename P>
class PhotonPass final : public Prepass {
 public:
  PhotonPass(int sample, int paths, float radius) : radius_m(radius), sample_(sample) {
    for (int from = 0; from < paths; from += kPartPaths) {
      ends_.push_back(std::min(from + kPartPaths, paths));
    }
    parts_.resize(ends_.size());
  }
  int sample() const noexcept override { return sample_; }
  int part_count() const noexcept override { return static_cast<int>(ends_.size()); }
  bool build() override {
    map = PhotonGrid<P>(parts_, radius_m);
    return true;
  }

  /// Calls trace(sampler, out) for each light path of a part; `out` takes its photons. All paths of
  /// a map share one point set; each map has another.
  template <typename Trace>
  void each_path(int part, const RenderSettings& settings, Trace&& trace) {
    PathSampler sampler(SamplerType::kSobol, settings.replicates, settings.seed | kPhotonStream,
                        settings.first_replicate);
    const int replicate = sample_ % settings.replicates;
    const auto at = static_cast<std::size_t>(part);
    for (int i = part * kPartPaths; i < ends_[at]; ++i) {
      sampler.start(sample_ / settings.replicates, 0, i * settings.replicates + replicate);
      trace(sampler, parts_[at]);
    }
  }

  float radius_m;
  PhotonGrid<P> map;

 private:
  static constexpr int kPartPaths = 1024;

  int sample_;
  std::vector<int> ends_;
  std::vector<std::vector<P>> parts_;
};

}  // namespace core
