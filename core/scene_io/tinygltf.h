/// tinygltf under a name of our own, without its image readers and its way to the file system.
///
/// libdraco.so exports another version of tinygltf and of stb_image under their usual names, with
/// classes laid out differently; which of the two a program calls would depend on the order in
/// which it was linked. So libtinygltf.so is not used: its header is compiled in tinygltf.cpp, and
/// the macro below gives its symbols another namespace. Include it through this header only.
#pragma once

#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS
#define tinygltf tessera_tinygltf  // NOLINT(readability-identifier-naming): replaces a namespace
#include <tiny_gltf.h>
