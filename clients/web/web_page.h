/// The files of the page that is served at `/`, held in the binary.
///
/// Made from the build of clients/web by embed.py. Every file has its URL path ("/" for index.html)
/// and an ETag over its plain bytes. Text is stored gzip-compressed (`is_gzip`): it goes out as it
/// is with `Content-Encoding: gzip`, or inflated to `plain_size` bytes for a client that does not
/// take gzip. Files under /assets/ carry a hash of their content in their name: they never change
/// (`is_immutable`).
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace web_page {

struct File {
  std::string_view path;  ///< "/", "/tessera.svg", "/assets/index-B7x.js"
  std::string_view mime;
  std::string_view etag;  ///< with its quotes
  const unsigned char* data;
  std::size_t size;        ///< bytes at `data`
  std::size_t plain_size;  ///< bytes of the file itself
  bool is_gzip;
  bool is_immutable;
};

/// In no order that means anything; a dozen entries, so that a look through them is fast enough.
std::span<const File> files();

}  // namespace web_page
