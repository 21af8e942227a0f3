/// Which images are shown without fireflies (core/film/set_aside.h).
#pragma once

#include <optional>
#include <string>

#include "api/requests.h"
#include "core/base/result.h"

namespace api {

struct FireflyImage {
  bool is_linear = false;  ///< of a format of high dynamic range
  bool is_denoised = false;
  std::optional<std::string> layer;  ///< empty: all of them, whose variances are of the raw halves
};

/// Returns whether to set fireflies aside, which denoising has done already. asked: empty: display
/// formats do. Errors: the image cannot be as asked, at "/fireflies".
core::Result<bool> sets_fireflies_aside(std::optional<Fireflies> asked, const FireflyImage& image);

}  // namespace api
