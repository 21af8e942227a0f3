/// MediumStack: the solids around a point, the innermost last.
///
/// Leaving one removes its newest entry, wherever it is, so overlapping and touching solids
/// keep their order.
#pragma once

#include <algorithm>

#include "core/scene/scene_data.h"

namespace core {

class MediumStack {
 public:
  const Material* top() const noexcept { return count_ > 0 ? media_[count_ - 1] : nullptr; }
  void enter(const Material* material) noexcept {
    if (count_ < kMax) {
      media_[count_++] = material;
    }
  }
  void leave(const Material* material) noexcept {
    for (int i = count_ - 1; i >= 0; --i) {
      if (media_[i] == material) {
        std::copy(media_ + i + 1, media_ + count_, media_ + i);
        --count_;
        return;
      }
    }
  }
  void cross(const Material& material, bool inwards) noexcept {
    inwards ? enter(&material) : leave(&material);
  }
  /// The medium on the other side of a boundary of `material`, for a path inside it.
  const Material* without(const Material* material) const noexcept {
    MediumStack rest = *this;
    rest.leave(material);
    return rest.top();
  }

 private:
  static constexpr int kMax = 8;
  const Material* media_[kMax] = {};
  int count_ = 0;
};

}  // namespace core
