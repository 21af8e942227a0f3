/// Encodes films as images: crop, layer, scale, range, look, metadata.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>

#include "api/answers/job_view.h"
#include "api/answers/server_view.h"
#include "api/requests.h"
#include "core/base/result.h"
#include "core/denoise/denoised_picture.h"
#include "core/film/film.h"
#include "core/image_io/image_io.h"
#include "core/scene/scene.h"
#include "server/observe/memory_gate.h"
#include "server/pictures/image_range.h"

namespace server {

/// The requested image. All members are borrowed.
struct Picture {
  const core::ImageFormat& format;
  const api::ImageQuery& query;
  const api::JobView& view;
  core::PixelRect rect;
  std::shared_ptr<const core::DenoisedPicture> denoised = nullptr;  ///< null: the plain picture
  std::optional<api::DenoisedView> denoised_view = std::nullopt;    ///< of `denoised`
  std::shared_ptr<const core::Scene> scene = nullptr;  ///< for the names of mattes; null: no names
  std::string tenant = {};                             ///< that asks for it
  std::optional<double> auto_exposure = std::nullopt;  ///< empty: to be computed from the film
};

struct EncodedPicture {
  std::shared_ptr<const std::string> content;  ///< holds a lease on its memory
  std::optional<ValueRange> range;             ///< of a data layer
  std::optional<double> set_aside = {};        ///< share of the light; empty: all was kept
  std::optional<float> exposure_stops;         ///< of a colour layer in a display format
};

/// Memory for encoded images of ended jobs: 60 of 1920x1080 as JPEG (half a megabyte each).
constexpr std::uint64_t kPictureCacheBytes = std::uint64_t{32} << 20U;

class PictureMaker {
 public:
  /// about: for the metadata of images of unfinished jobs. Both must outlive it.
  PictureMaker(MemoryGate& memory, const api::ServerView& about) : memory_(memory), about_(about) {}

  /// picture.rect: inside the film. patience: longest wait for memory. Errors: kInvalidArgument at
  /// the parameter; kUnavailable.
  core::Result<EncodedPicture> make(const core::Film& film, const Picture& picture,
                                    std::chrono::milliseconds patience) const;

 private:
  MemoryGate& memory_;
  const api::ServerView& about_;
};

/// Returns whether the image stores names from the job's scene.
bool wants_names(const core::ImageFormat& format, const core::FilmSettings& film);

/// Returns kInvalidArgument when the requested rectangle reaches beyond the film.
std::optional<core::Error> refused_part(core::PixelRect part, core::PixelRect crop);

}  // namespace server
