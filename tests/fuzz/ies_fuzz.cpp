// Any bytes as a light profile: no crash, and accepted profiles emit finite light in the directions
// that they sample.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/check.h"
#include "core/scene_io/ies.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<std::string> warnings;
  const auto profile =
      core::read_ies(std::string_view(reinterpret_cast<const char*>(data), size), warnings);
  if (!profile) {
    CHECK(!profile.error().message.empty());
    return 0;
  }
  CHECK(std::isfinite(profile->lumens()) && profile->lumens() >= 0);
  CHECK(profile->cos_reach() >= -1 && profile->cos_reach() <= 1);
  constexpr std::array<float, 4> kPlaces = {0, 0.3F, 0.7F, 0.999999F};
  for (const float u : kPlaces) {
    for (const float v : kPlaces) {
      const core::Vec3 direction = profile->sample({u, v});
      CHECK(std::fabs(core::length(direction) - 1) < 1e-4F);
      const float candela = profile->candela(direction);
      CHECK(std::isfinite(candela) && candela >= 0);
      const float pdf = profile->pdf_solid_angle(direction);
      CHECK(profile->lumens() == 0 || (std::isfinite(pdf) && pdf >= 0));
    }
  }
  return 0;
}
