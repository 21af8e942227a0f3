// The exports of libtessera-images.so.
#include "core/image_io/oiio/oiio.h"

extern "C" {
// NOLINTNEXTLINE(readability-identifier-naming): the loader looks for this name
[[gnu::visibility("default")]] extern const core::ImageCodec tessera_image_codec;
const core::ImageCodec tessera_image_codec = {core::oiio::read_header, core::oiio::decode,
                                              core::oiio::encode};
}
