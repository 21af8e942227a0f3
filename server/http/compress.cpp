#include "server/http/compress.h"

#include <array>
#include <new>

#include <zlib.h>

#include "core/base/check.h"

namespace server {

struct GzipEncoder::State {
  z_stream stream = {};
};

GzipEncoder::GzipEncoder() : state_(std::make_unique<State>()) {
  constexpr int kGzipWindowBits = 15 + 16;  // 16 selects the gzip wrapper.
  constexpr int kMemoryLevel = 8;
  if (deflateInit2(&state_->stream, Z_BEST_SPEED, Z_DEFLATED, kGzipWindowBits, kMemoryLevel,
                   Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::bad_alloc();
  }
}

GzipEncoder::~GzipEncoder() { deflateEnd(&state_->stream); }

void GzipEncoder::encode(std::string_view bytes, std::string& out) {
  run(bytes, Z_SYNC_FLUSH, out);
}

void GzipEncoder::finish(std::string_view last_bytes, std::string& out) {
  run(last_bytes, Z_FINISH, out);
}

void GzipEncoder::run(std::string_view bytes, int flush, std::string& out) {
  constexpr std::size_t kMaxInputBytes = 1U << 30U;  // avail_in has 32 bits.
  std::array<unsigned char, 16U << 10U> buffer;
  z_stream& stream = state_->stream;
  do {
    const std::string_view piece = bytes.substr(0, kMaxInputBytes);
    bytes.remove_prefix(piece.size());
    // zlib only reads through this pointer; its interface lacks const.
    stream.next_in =
        const_cast<unsigned char*>(reinterpret_cast<const unsigned char*>(piece.data()));
    stream.avail_in = static_cast<unsigned>(piece.size());
    const int piece_flush = bytes.empty() ? flush : Z_NO_FLUSH;
    do {
      stream.next_out = buffer.data();
      stream.avail_out = static_cast<unsigned>(buffer.size());
      CHECK(deflate(&stream, piece_flush) != Z_STREAM_ERROR);
      out.append(reinterpret_cast<const char*>(buffer.data()), buffer.size() - stream.avail_out);
    } while (stream.avail_out == 0);
  } while (!bytes.empty());
}

std::string gzip(std::string_view bytes) {
  std::string out;
  GzipEncoder().finish(bytes, out);
  return out;
}

}  // namespace server
