/// Layers: pictures made of a film.
#pragma once

#include <string_view>

#include "core/base/result.h"
#include "core/film/film.h"
#include "core/image_io/image.h"

namespace core {

/// Layer `name` (a row of layers()) as a float image. Unknown errors are NaN. Errors:
/// kInvalidArgument when the layer is unknown or was not recorded.
Result<FloatImage> layer_image(const FilmSnapshot& film, std::string_view name);
/// All recorded layers in one image, for EXR: R G B A of beauty, then channels such as albedo.R.
FloatImage all_layers_image(const FilmSnapshot& film, const FilmSettings& settings);

}  // namespace core
