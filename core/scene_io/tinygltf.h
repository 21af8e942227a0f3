/// tinygltf in a namespace of its own, without its image readers and file system access.
///
/// libdraco.so exports another version of tinygltf and of stb_image under the original names, with
/// different class layouts; the link order would decide which one a program calls. So
/// libtinygltf.so is not used: its header is compiled in tinygltf.cpp, and the macro below moves
/// its symbols to another namespace. Include it only through this header.
#pragma once

#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS
#define tinygltf tessera_tinygltf  // NOLINT(readability-identifier-naming): replaces a namespace
#include <tiny_gltf.h>
