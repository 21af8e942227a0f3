/// Uploads of scenes: reading the body, telling its kind, answering a failure.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "server/http/message.h"
#include "server/routes/context.h"
#include "server/scenes/scene_service.h"

namespace server {

/// Reads the body into memory once it is reserved; the HTTP server limits its size.
core::Result<SceneService::Upload> read_body(const RouteContext& context, const Request& request);

/// By the first bytes: of every record of a zip archive (APPNOTE.TXT, 4.3), and of a GLB (glTF 2.0,
/// 4.4.2). No JSON begins so.
inline bool is_zip_archive(std::string_view content) { return content.starts_with("PK"); }
inline bool is_glb(std::string_view content) { return content.starts_with("glTF"); }

/// Returns the extension of the format that an upload may have besides glTF: of a type model/stl,
/// or else of its name; empty: none. type: a media type without parameters.
std::string format_of(std::string_view type, std::string_view name);

/// Returns the answer to a scene that was not added; empty if it was.
std::optional<Response> refused_scene(const Request& request,
                                      const core::Result<SceneService::Added>& added);

}  // namespace server
