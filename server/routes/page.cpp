#include "server/routes/page.h"

#include <cstring>

#include <zlib.h>

#include "clients/web/web_page.h"
#include "core/base/check.h"
#include "server/http/conditional.h"
#include "server/http/security_headers.h"

namespace server {
namespace {

/// Returns the uncompressed bytes; the response is compressed again for clients that accept it.
std::string plain_bytes(const web_page::File& file) {
  if (!file.is_gzip) {
    return {reinterpret_cast<const char*>(file.data), file.size};
  }
  std::string plain(file.plain_size, '\0');
  z_stream stream;
  std::memset(&stream, 0, sizeof stream);
  CHECK(inflateInit2(&stream, 15 + 16) == Z_OK);
  stream.next_in = const_cast<Bytef*>(file.data);  // zlib's interface; zlib does not write to it
  stream.avail_in = static_cast<uInt>(file.size);
  stream.next_out = reinterpret_cast<Bytef*>(plain.data());
  stream.avail_out = static_cast<uInt>(plain.size());
  CHECK(inflate(&stream, Z_FINISH) == Z_STREAM_END);
  inflateEnd(&stream);
  return plain;
}

}  // namespace

Response page_answer(const Request& request, const PageFile& file) {
  Response response;
  if (is_not_modified(request, file.etag)) {
    response = not_modified(file.etag);
  } else {
    response = bytes_response(200, file.content_type, file.content);
    response.headers.set("ETag", file.etag);
    response.compressible = true;
  }
  response.headers.set("Content-Security-Policy", page_policy("'none'"));
  response.headers.set("Cache-Control",
                       file.is_immutable ? "public, max-age=31536000, immutable" : "no-cache");
  return response;
}

const std::vector<PageFile>& page_files() {
  static const std::vector<PageFile> kFiles = [] {
    std::vector<PageFile> files;
    for (const web_page::File& file : web_page::files()) {
      files.push_back({.path = std::string(file.path),
                       .content_type = std::string(file.mime),
                       .content = std::make_shared<const std::string>(plain_bytes(file)),
                       .etag = std::string(file.etag),
                       .is_immutable = file.is_immutable});
    }
    return files;
  }();
  return kFiles;
}

}  // namespace server
