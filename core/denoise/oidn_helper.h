/// The helper process: calls Open Image Denoise 2.x through its C interface, loaded at run time.
///
/// It is a separate process, so that a crash, a hang or the memory of the library does not affect
/// the server, and the two do not share TBB. Never a build dependency.
#pragma once

#include <string>

namespace core {

/// Serves one request on the socket. folder: contains the library. Returns false if the other end
/// is closed.
bool serve_oidn(int socket, const std::string& folder);

}  // namespace core
