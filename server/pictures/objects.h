/// objects(): what the ids in a film are, and where they are.
#pragma once

#include "api/objects_view.h"
#include "core/base/result.h"
#include "core/film/film.h"
#include "core/render/view.h"

namespace server {

/// view: of the job that made the film. Errors: those of its camera.
core::Result<api::ObjectsView> objects(const core::Film& film, const core::View& view);

}  // namespace server
