#include "core/render/picture/meter.h"

#include <algorithm>

#include "core/base/cpu_time.h"
#include "core/samplers/streams.h"

namespace core {
namespace {

constexpr auto kReplicates = static_cast<std::size_t>(kMeterReplicates);
}  // namespace

Meter::Meter(const IntegratorInput& input)
    : points_(meter_points(input.settings.meter)),
      seed_(input.settings.seed | kMeterStream),
      first_replicate_(input.settings.first_replicate / 2 * kMeterReplicates),
      origin_(input.scene.origin),
      tracer_(input) {
  if (input.scene.has_volumes) {
    for (const MeterPoint& point : points_) {
      media_.push_back(tracer_.media_at((point.position - origin_).rounded(), point.normal));
    }
  }
}

bool Meter::render(int chunk, MeterChunk& state, int last_sample,
                   const std::stop_token& stop) const {
  const double cpu_start = thread_cpu_seconds();
  const int first = chunk * kMeterChunk;
  const int end = std::min(first + kMeterChunk, static_cast<int>(points_.size()));
  state.sums.resize(static_cast<std::size_t>(end - first) * kReplicates);
  PathSampler sampler(SamplerType::kSobol, kMeterReplicates, seed_, first_replicate_);
  for (int i = first; i < end; ++i) {
    if (stop.stop_requested()) {
      return false;
    }
    const MeterPoint& point = points_[static_cast<std::size_t>(i)];
    const MediumStack media = media_.empty() ? MediumStack{} : media_[static_cast<std::size_t>(i)];
    const Vec3 at = (point.position - origin_).rounded();
    const auto sums =
        state.sums.begin() + static_cast<std::ptrdiff_t>(i - first) * kMeterReplicates;
    for (int s = state.samples * kMeterReplicates; s < last_sample * kMeterReplicates; ++s) {
      sampler.start(i, 0, s);
      const Rgb found = tracer_.sample(at, point.normal, media, sampler, state.rays);
      if (!is_finite(found)) {
        ++state.rejected_samples;
        continue;
      }
      auto& sum = *(sums + s % kMeterReplicates);
      sum[0] += static_cast<double>(found.r);
      sum[1] += static_cast<double>(found.g);
      sum[2] += static_cast<double>(found.b);
    }
  }
  state.samples = last_sample;
  state.cpu_seconds += thread_cpu_seconds() - cpu_start;
  return true;
}

}  // namespace core
