/// The helper process: Open Image Denoise 2.x by its C interface, loaded at run time.
///
/// In a process of its own, so that a crash, a hang or the memory of the library is no matter of
/// the server's, nor the TBB that both would share. Never a build dependency.
#pragma once

#include <string>

namespace core {

/// Serves one request on the socket. folder: where the library is. False: the other end is closed.
bool serve_oidn(int socket, const std::string& folder);

}  // namespace core
