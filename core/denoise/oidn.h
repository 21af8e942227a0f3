/// Denoises with Open Image Denoise if its library is installed: in a helper process, which is this
/// program with the verb `denoise`.
#pragma once

#include <chrono>
#include <string>

#include "core/denoise/denoiser.h"

namespace core {

struct OidnOptions {
  std::string program = "/proc/self/exe";  ///< started as PROGRAM denoise FOLDER
  std::string folder;                      ///< contains libOpenImageDenoise.so.2
  /// A helper that takes longer is killed; as much again is added per million pixels of an image.
  std::chrono::seconds patience{20};
};

/// Returns the folder of TESSERA_OIDN, or its `lib` if that contains the library; without the
/// variable, `oidn/lib` next to the program, or `../lib/tessera/oidn/lib`, as packages have it.
/// Empty if none is available.
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
