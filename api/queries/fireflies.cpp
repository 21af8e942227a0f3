#include "api/queries/fireflies.h"

#include "core/base/invalid.h"
#include "core/layers/layers.h"

namespace api {

core::Result<bool> sets_fireflies_aside(std::optional<Fireflies> asked, const FireflyImage& image) {
  const auto refused = [](const char* why) { return core::invalid("/fireflies", why); };
  if (image.is_denoised) {
    return asked == Fireflies::kKeep ? refused("denoised images are made without fireflies")
                                     : core::Result<bool>(false);
  }
  if (!image.layer) {
    return asked == Fireflies::kSetAside
               ? refused("an EXR of all layers keeps its light; an image of beauty need not")
               : core::Result<bool>(false);
  }
  if (!core::has_fireflies(image.layer)) {
    return asked ? refused("applies only to beauty and light shares") : core::Result<bool>(false);
  }
  return asked ? asked == Fireflies::kSetAside : !image.is_linear;
}

}  // namespace api
