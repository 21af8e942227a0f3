/// The inspector's data of one pixel.
#pragma once

#include "api/answers/job_view.h"
#include "api/job/job_spec.h"
#include "core/film/film.h"

namespace server {

/// x, y: inside the snapshot, in pixels of the full film. Intervals exist where two halves give
/// them; the layers are those that the job records.
api::PixelView pixel_view(const core::FilmSnapshot& snapshot, const api::JobSpec& spec, int x,
                          int y);

}  // namespace server
