/// False colours that distinguish ids on screens.
#pragma once

#include "core/image_io/image_rows.h"
#include "core/layers/layer_rows.h"

namespace server {

/// form: meaning of the image's channels. Ids: one colour each, black for none. Mattes: the colours
/// of their ids, weighted by coverage.
core::ImageRows false_colors(core::ImageRows image, core::LayerForm form);

}  // namespace server
