/// Prepass: what camera paths look up, made before them.
#pragma once

namespace core {

/// The photons of one sample, or a cache for all samples. A function of the job alone: whatever
/// threads do which part, in any order, and however often it is made again after a restart, it is
/// the same.
class Prepass {
 public:
  virtual ~Prepass() = default;
  /// The first sample that it serves, which bears what it has cost.
  virtual int sample() const noexcept = 0;
  virtual bool serves(int sample) const noexcept { return sample == this->sample(); }
  /// Of this round.
  virtual int part_count() const noexcept = 0;
  /// After the last part. False: another round follows. True: from then on any thread may read.
  virtual bool build() = 0;
};

}  // namespace core
