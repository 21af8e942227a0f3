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
  CHECK(type != DenoiserType::kNone);
  const StatisticalDenoiser statistical;
  const std::string folder = find_oidn();
  const bool takes_oidn =
      type == DenoiserType::kOidn || (type == DenoiserType::kAuto && !folder.empty());
  if (!takes_oidn) {
    return denoise(film, features, statistical, parallel);
  }
  auto made = denoise(film, features, OidnDenoiser({.folder = folder}), parallel);
  if (made || type == DenoiserType::kOidn) {
    return made;
  }
  const std::string why = made.error().message;
  made = denoise(film, features, statistical, parallel);
  if (made) {
    made->note = why;
  }
  return made;
}

}  // namespace core
