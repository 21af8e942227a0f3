#include "core/image_io/image_codec.h"

#include <string>

#include <dlfcn.h>

namespace core {

Result<const ImageCodec*> image_codec() {
  // Never unloaded: OpenImageIO keeps pointers in threads and at exit.
  static void* const kModule = dlopen("libtessera-images.so", RTLD_LAZY | RTLD_LOCAL);
  static const void* const kCodec =
      kModule == nullptr ? nullptr : dlsym(kModule, "tessera_image_codec");
  if (kCodec == nullptr) {
    static const std::string kWords = [] {
      const char* words = dlerror();
      return std::string(words == nullptr ? "unknown to the loader" : words);
    }();
    return Error{ErrorCode::kInternal, "images cannot be read or written: " + kWords, ""};
  }
  return static_cast<const ImageCodec*>(kCodec);
}

}  // namespace core
