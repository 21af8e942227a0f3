/// Files of the web page, served from memory by path.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "server/http/message.h"

namespace server {

struct PageFile {
  std::string path;  ///< "/" or "/assets/index-3fa2.js"
  std::string content_type;
  SharedBytes content;
  std::string etag;
  bool is_immutable = false;  ///< The name changes with the content.
};
/// Returns them all, which are decompressed once.
const std::vector<PageFile>& page_files();

/// Path of the view of one job that other pages may frame, without the job's id.
inline constexpr std::string_view kEmbedPath = "/embed/";

/// Returns 200 or 304, compressed when the client accepts it.
Response page_answer(const Request& request, const PageFile& file);

}  // namespace server
