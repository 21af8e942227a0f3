#include <array>
#include <string>

#include "core/base/check.h"
#include "core/denoise/make_denoiser.h"
#include "core/denoise/oidn.h"
#include "core/denoise/statistical.h"
#include "core/settings/choices.h"

namespace core {
namespace {

constexpr std::array kDenoisers = {
    NamedValue<DenoiserType>{"none", DenoiserType::kNone,
                             "No denoising: requests for denoised images are refused."},
    NamedValue<DenoiserType>{"auto", DenoiserType::kAuto,
                             "oidn where its library is installed, else statistical."},
    NamedValue<DenoiserType>{
        "statistical", DenoiserType::kStatistical,
        "A joint filter based on Welch's test; the same bits for any number of threads."},
    NamedValue<DenoiserType>{"oidn", DenoiserType::kOidn,
                             "Intel's Open Image Denoise, a neural network, if it is installed."},
};

/// Returns make(denoiser) of the denoiser of this type; note: why `auto` did not take oidn.
template <typename Make>
auto with_denoiser(DenoiserType type, std::string& note, const Make& make)
    -> decltype(make(StatisticalDenoiser())) {
  CHECK(type != DenoiserType::kNone);
  const std::string folder = find_oidn();
  if (type == DenoiserType::kOidn || (type == DenoiserType::kAuto && !folder.empty())) {
    auto made = make(OidnDenoiser({.folder = folder}));
    if (made || type == DenoiserType::kOidn) {
      return made;
    }
    note = made.error().message;
  }
  return make(StatisticalDenoiser());
}

}  // namespace

std::span<const NamedValue<DenoiserType>> denoisers() { return kDenoisers; }

std::string to_text(const DenoiserFacts& facts) {
  std::string out = facts.type;
  out.append(" ").append(facts.version);
  if (!facts.quality.empty()) {
    out.append(", ").append(facts.quality);
  }
  if (!facts.sha256.empty()) {
    out.append(", sha256 ").append(facts.sha256);
  }
  if (facts.frames > 0) {
    out.append(", with ").append(std::to_string(facts.frames)).append(" more of the series");
  }
  return out;
}

Result<MadeDenoised> denoise_with(DenoiserType type, const FilmSnapshot& film,
                                  const FeaturePicture* features, const ParallelFor& parallel) {
  std::string note;
  auto made = with_denoiser(type, note, [&](const Denoiser& denoiser) {
    return denoise(film, features, denoiser, parallel);
  });
  if (made) {
    made->note = note;
  }
  return made;
}

Result<CleanFilm> clean_with(DenoiserType type, const FilmSnapshot& film,
                             const FeaturePicture* features, const ParallelFor& parallel) {
  std::string note;  // The first image of a job tells it.
  return with_denoiser(type, note, [&](const Denoiser& denoiser) {
    return clean_film(film, features, denoiser, parallel);
  });
}

}  // namespace core
