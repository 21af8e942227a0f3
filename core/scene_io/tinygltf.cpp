// The implementation part of tinygltf's header.

// clang-format off: the header needs <fstream> before it, and forgets it without stb_image.
#include <fstream>
// clang-format on

#define TINYGLTF_IMPLEMENTATION
#include "core/scene_io/tinygltf.h"
