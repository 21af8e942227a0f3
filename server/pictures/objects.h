/// objects(): what the ids in a film are, and where they are.
#pragma once

#include <cstdint>

#include "api/job_spec.h"
#include "api/objects_view.h"
#include "core/base/result.h"
#include "core/film/film.h"
#include "core/labels/object_boxes.h"
#include "core/render/view.h"
#include "server/scenes/single_flight_cache.h"

namespace server {

/// Boxes take as long as all triangles take to be read: they are kept by what is seen and whose
/// boxes are asked for.
class ObjectsMaker {
 public:
  /// view: of the job of that spec, which made the film. Errors: those of its camera.
  core::Result<api::ObjectsView> make(const core::Film& film, const core::View& view,
                                      const api::JobSpec& spec);

 private:
  /// A box of each of 100,000 objects and instances.
  static constexpr std::uint64_t kBytesMax = std::uint64_t{16} << 20U;
  SingleFlightCache<core::ObjectBoxes> boxes_{
      kBytesMax, SingleFlightCache<core::ObjectBoxes>::Oversized::kNotKept};
};

}  // namespace server
