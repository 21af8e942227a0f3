/// Layers: pictures made of a film.
#pragma once

#include <string>

#include "core/base/result.h"
#include "core/film/film.h"
#include "core/image_io/image.h"

namespace core {

/// Layer `name` (a row of layers()) as a float image. Unknown errors are NaN. Errors:
/// kInvalidArgument when the layer is unknown or was not recorded.
Result<FloatImage> layer_image(const FilmSnapshot& film, const std::string& name);
/// All recorded layers in one image: R G B A, albedo.R ..., normal.X ..., depth.Z, samples.Y,
/// variance.R ..., error.Y. For EXR.
FloatImage all_layers_image(const FilmSnapshot& film, const FilmSettings& settings);

}  // namespace core
