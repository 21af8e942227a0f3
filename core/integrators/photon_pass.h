/// PhotonPass: photons of one sample.
#pragma once

namespace core {

/// Photons that the camera paths of one sample look up, from the lights to the map. A function of
/// the job and the sample: whatever threads trace which part, in any order, the map is the same.
class PhotonPass {
 public:
  virtual ~PhotonPass() = default;
  virtual int sample() const noexcept = 0;
  virtual int part_count() const noexcept = 0;
  /// After the last part; from then on any thread may read.
  virtual void build() = 0;
};

}  // namespace core
