/// Describes the objects whose ids are in a film, and their bounds.
#pragma once

#include <cstdint>

#include "api/answers/objects_view.h"
#include "api/job/job_spec.h"
#include "core/aovs/object_boxes.h"
#include "core/base/result.h"
#include "core/film/film.h"
#include "core/render/picture/view.h"
#include "server/scenes/single_flight_cache.h"

namespace server {

/// Computing bounds reads all triangles, so they are cached by view and the requested ids.
class ObjectsMaker {
 public:
  /// view: of the job with that spec, which rendered the film. Errors: of its camera.
  core::Result<api::ObjectsView> make(const core::Film& film, const core::View& view,
                                      const api::JobSpec& spec);

 private:
  /// Bounds of 100,000 objects and instances.
  static constexpr std::uint64_t kBytesMax = std::uint64_t{16} << 20U;
  SingleFlightCache<core::ObjectBoxes> boxes_{
      kBytesMax, SingleFlightCache<core::ObjectBoxes>::Oversized::kNotKept};
};

}  // namespace server
