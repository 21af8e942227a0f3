/// One-time settings of OpenImageIO; private to core/image_io.
#pragma once

namespace core {

/// OpenImageIO shall start no threads of its own: the renderer's pool owns the cores.
void set_up_oiio();

}  // namespace core
