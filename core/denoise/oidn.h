/// The denoiser of Open Image Denoise, if its library is there: in a helper process, which is this
/// program with the verb `denoise`.
#pragma once

#include <chrono>
#include <string>

#include "core/denoise/denoiser.h"

namespace core {

struct OidnOptions {
  std::string program = "/proc/self/exe";  ///< is started as PROGRAM denoise FOLDER
  std::string folder;                      ///< with libOpenImageDenoise.so.2
  /// A helper that takes longer is ended; so much for each million pixels of a picture on top.
  std::chrono::seconds patience{20};
};

/// The folder that TESSERA_OIDN names, or its `lib` if the library is there; else `oidn/lib` beside
/// the program; empty: none is named, and no library is there.
std::string find_oidn();

class OidnDenoiser final : public Denoiser {
 public:
  explicit OidnDenoiser(OidnOptions options) : options_(std::move(options)) {}
  Result<FilteredHalves> denoise(std::span<const HalfPicture> halves,
                                 const FeaturePicture* features,
                                 const ParallelFor& parallel) const override;

 private:
  OidnOptions options_;
};

}  // namespace core
