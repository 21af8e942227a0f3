/// Encodings of text files.
#pragma once

#include "core/scene_io/gltf_load.h"

namespace core {

/// Makes UTF-8 without a byte order mark of text that begins with one, which Windows' programs
/// write: of UTF-8, or of UTF-16. Other text stays.
void make_utf8(Bytes& text);

}  // namespace core
