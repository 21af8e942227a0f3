// The implementation part of tinygltf's header.
#define TINYGLTF_IMPLEMENTATION
#include <fstream>  // without stb_image the header forgets it

#include "core/scene_io/tinygltf.h"
