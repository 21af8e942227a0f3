/// Colours that tell ids apart, for screens.
#pragma once

#include "core/image_io/image_rows.h"
#include "core/settings/registry.h"

namespace server {

/// form: what the channels of the image are. Ids: a colour for each, black for none. Mattes: the
/// colours of their ids, each as much as it covers.
core::ImageRows false_colors(core::ImageRows image, core::LayerForm form);

}  // namespace server
