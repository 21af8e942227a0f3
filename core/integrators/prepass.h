/// Prepass: computes data that camera paths look up, before they are traced.
#pragma once

namespace core {

/// The photons of one sample, or a cache for all samples. A function of the job alone: the result
/// does not depend on the order of the parts, their threads, or repetition after a restart.
class Prepass {
 public:
  virtual ~Prepass() = default;
  /// The first sample that it serves, to which its cost is charged.
  virtual int sample() const noexcept = 0;
  virtual bool serves(int sample) const noexcept { return sample == this->sample(); }
  /// Number of parts of the current round.
  virtual int part_count() const noexcept = 0;
  /// Call after the last part. Returns false if another round follows. After it returns true, any
  /// thread may read the prepass.
  virtual bool build() = 0;
};

}  // namespace core
