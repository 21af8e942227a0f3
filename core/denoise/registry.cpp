#include <array>
#include <utility>

#include "core/base/check.h"
#include "core/denoise/make_denoiser.h"
#include "core/denoise/oidn.h"
#include "core/denoise/statistical.h"

namespace core {
namespace {

constexpr std::array kDenoisers = {
    NamedValue<DenoiserType>{"none", DenoiserType::kNone, "Denoised pictures are refused."},
    NamedValue<DenoiserType>{"auto", DenoiserType::kAuto,
                             "oidn where its library is installed, else statistical."},
    NamedValue<DenoiserType>{"statistical", DenoiserType::kStatistical,
                             "A joint filter by Welch's test; the same bits on any threads."},
    NamedValue<DenoiserType>{"oidn", DenoiserType::kOidn,
                             "Intel's Open Image Denoise, a neural network, if it is installed."},
};

Result<MadeDenoised> denoise_by(const Denoiser& denoiser, const FilmSnapshot& film,
                                const FeaturePicture* features, const ParallelFor& parallel) {
  auto picture = denoise(film, features, denoiser, parallel);
  if (!picture) {
    return picture.error();
  }
  return MadeDenoised{.picture = *std::move(picture),
                      .denoiser = std::string(denoiser.name()),
                      .version = denoiser.version(),
                      .quality = denoiser.quality(),
                      .note = {}};
}

}  // namespace

std::span<const NamedValue<DenoiserType>> denoisers() { return kDenoisers; }

Result<MadeDenoised> denoise_with(DenoiserType type, const FilmSnapshot& film,
                                  const FeaturePicture* features, const ParallelFor& parallel) {
  CHECK(type != DenoiserType::kNone);
  const StatisticalDenoiser statistical;
  const std::string folder = find_oidn();
  const bool takes_oidn =
      type == DenoiserType::kOidn || (type == DenoiserType::kAuto && !folder.empty());
  if (!takes_oidn) {
    return denoise_by(statistical, film, features, parallel);
  }
  auto made = denoise_by(OidnDenoiser({.folder = folder}), film, features, parallel);
  if (made || type == DenoiserType::kOidn) {
    return made;
  }
  const std::string why = made.error().message;
  made = denoise_by(statistical, film, features, parallel);
  if (made) {
    made->note = why;
  }
  return made;
}

}  // namespace core
