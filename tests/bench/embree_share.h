/// How much of the processor's time is spent inside Embree.
#pragma once

namespace bench {

/// Samples the program counter at every five milliseconds of CPU time of the process, on x86-64
/// Linux. One at a time.
class EmbreeShare {
 public:
  EmbreeShare();
  ~EmbreeShare();
  EmbreeShare(const EmbreeShare&) = delete;
  EmbreeShare& operator=(const EmbreeShare&) = delete;

  /// Of the samples since the construction, 0 to 1; NaN when there is none yet.
  double share() const;
};

}  // namespace bench
