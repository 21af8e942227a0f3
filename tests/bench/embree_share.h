/// Fraction of the CPU time that is spent inside Embree.
#pragma once

namespace bench {

/// Samples the program counter every five milliseconds of CPU time of the process, on x86-64 Linux.
/// One instance at a time.
class EmbreeShare {
 public:
  EmbreeShare();
  ~EmbreeShare();
  EmbreeShare(const EmbreeShare&) = delete;
  EmbreeShare& operator=(const EmbreeShare&) = delete;

  /// Fraction of the samples since construction, 0 to 1; NaN if there is none yet.
  double share() const;
};

}  // namespace bench
