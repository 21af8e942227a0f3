#include "server/http/response_writer.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <ctime>
#include <exception>
#include <memory>
#include <optional>

#include "server/http/compress.h"
#include "server/http/negotiation.h"
#include "server/http/problem.h"
#include "server/http/text.h"

namespace server {
namespace {

constexpr std::size_t kMinGzipBytes = 1024;

/// "Sun, 06 Nov 1994 08:49:37 GMT"; generated once per second and thread.
const std::string& http_date() {
  thread_local std::time_t cached_time = 0;
  thread_local std::string cached_text;
  const std::time_t now = std::time(nullptr);
  if (now != cached_time) {
    std::tm utc = {};
    gmtime_r(&now, &utc);
    std::array<char, 64> text = {};
    const std::size_t length =
        std::strftime(text.data(), text.size(), "%a, %d %b %Y %H:%M:%S GMT", &utc);
    cached_text.assign(text.data(), length);
    cached_time = now;
  }
  return cached_text;
}

bool is_body_allowed(int status) { return status >= 200 && status != 204 && status != 304; }

/// Values may contain client input: a line break would let the client start its own header.
void append_field(std::string& head, std::string_view name, std::string_view value) {
  if (!is_token(name)) {
    return;
  }
  head += name;
  head += ": ";
  for (const char c : value) {
    const auto byte = static_cast<unsigned char>(c);
    head += (byte < 0x20 && c != '\t') || byte == 0x7F ? ' ' : c;
  }
  head += "\r\n";
}

class BodyStreamWriter final : public StreamWriter {
 public:
  BodyStreamWriter(Channel& channel, ClientWatch::State& state, const ClientWatch& watch)
      : channel_(channel), state_(state), watch_(watch) {}

  void use_chunks() { is_chunked_ = true; }
  void use_gzip() { encoder_ = std::make_unique<GzipEncoder>(); }

  bool write(std::string_view bytes) override {
    if (encoder_ == nullptr) {
      return send(bytes);
    }
    std::string encoded;
    encoder_->encode(bytes, encoded);
    return send(encoded);
  }

  bool client_gone() const override { return has_failed_ || state_.client_gone.load(); }
  bool stopping() const override { return watch_.is_stopping(); }
  std::stop_token stop_token() const override { return state_.stop.get_token(); }

  /// Ends the body. Returns false if the client did not receive all of it.
  bool finish() {
    if (encoder_ != nullptr) {
      std::string encoded;
      encoder_->finish({}, encoded);
      send(encoded);
    }
    if (is_chunked_ && !client_gone()) {
      has_failed_ = !channel_.write({"0\r\n\r\n"});
    }
    return !client_gone();
  }
  std::uint64_t body_bytes() const { return body_bytes_; }

 private:
  bool send(std::string_view bytes) {
    if (client_gone()) {
      return false;
    }
    if (bytes.empty()) {
      return true;
    }
    if (is_chunked_) {
      std::array<char, 24> size = {};
      const int length = std::snprintf(size.data(), size.size(), "%zx\r\n", bytes.size());
      has_failed_ = !channel_.write(
          {std::string_view(size.data(), static_cast<std::size_t>(length)), bytes, "\r\n"});
    } else {
      has_failed_ = !channel_.write({bytes});
    }
    if (has_failed_) {
      // Also wakes waiters on the token.
      state_.client_gone = true;
      state_.stop.request_stop();
      return false;
    }
    body_bytes_ += bytes.size();
    return true;
  }

  Channel& channel_;
  ClientWatch::State& state_;
  const ClientWatch& watch_;
  std::unique_ptr<GzipEncoder> encoder_;
  bool is_chunked_ = false;
  bool has_failed_ = false;
  std::uint64_t body_bytes_ = 0;
};

class ResponseWriter {
 public:
  ResponseWriter(Channel& channel, Response& response, const WriteContext& context)
      : channel_(channel), response_(response), context_(context) {}

  Written write() {
    channel_.restart_pace();
    written_.keep_alive = context_.keep_alive;
    has_body_ = is_body_allowed(response_.status) && context_.request.method != "HEAD";
    if (auto* stream = std::get_if<StreamBody>(&response_.body)) {
      write_stream(*stream);
    } else if (auto* file = std::get_if<FileBody>(&response_.body)) {
      write_file(*file);
    } else {
      write_bytes();
    }
    return std::move(written_);
  }

 private:
  bool may_gzip() {
    if (!response_.compressible || response_.headers.contains("Content-Encoding")) {
      return false;
    }
    response_.headers.add("Vary", "Accept-Encoding");
    const auto accepted = context_.request.headers.joined("Accept-Encoding");
    return accepted && accepts_encoding(*accepted, "gzip");
  }

  void announce_gzip() {
    response_.headers.add("Content-Encoding", "gzip");
    // Another representation needs another tag; conditional.h ignores the suffix.
    if (const auto etag = response_.headers.find("ETag"); etag && etag->size() > 1) {
      std::string gzip_tag(*etag);
      gzip_tag.insert(gzip_tag.size() - 1, "-gzip");
      response_.headers.set("ETag", gzip_tag);
    }
  }

  std::string make_head(std::optional<std::uint64_t> body_bytes) const {
    std::string head;
    head.reserve(512);
    head += "HTTP/1.1 ";
    head += std::to_string(response_.status);
    head += ' ';
    head += reason_phrase(response_.status);
    head += "\r\n";
    for (const Headers::Field& field : response_.headers.fields()) {
      append_field(head, field.name, field.value);
    }
    append_field(head, "Date", http_date());
    append_field(head, "X-Request-Id", context_.request.request_id);
    if (!written_.keep_alive) {
      head += "Connection: close\r\n";
    } else if (!context_.is_http_1_1) {
      head += "Connection: keep-alive\r\n";
    }
    if (is_body_allowed(response_.status)) {
      if (body_bytes) {
        head += "Content-Length: ";
        head += std::to_string(*body_bytes);
        head += "\r\n";
      } else if (context_.is_http_1_1) {
        head += "Transfer-Encoding: chunked\r\n";
      }
    }
    head += "\r\n";
    return head;
  }

  void write_bytes() {
    std::string_view body;
    if (const auto* text = std::get_if<std::string>(&response_.body)) {
      body = *text;
    } else if (const auto& shared = std::get<SharedBytes>(response_.body)) {
      body = *shared;
    }
    std::string compressed;
    if (may_gzip() && body.size() >= kMinGzipBytes) {
      compressed = gzip(body);
      body = compressed;
      announce_gzip();
    }
    const std::string head = make_head(body.size());
    written_.is_complete = channel_.write({head, has_body_ ? body : std::string_view()});
    written_.body_bytes = has_body_ && written_.is_complete ? body.size() : 0;
  }

  void write_file(const FileBody& file) {
    const std::string head = make_head(file.size());
    written_.is_complete = channel_.write({head});
    if (written_.is_complete && has_body_) {
      written_.is_complete = channel_.write_file(file.fd(), file.offset(), file.size());
      written_.body_bytes = written_.is_complete ? file.size() : 0;
    }
  }

  void write_stream(StreamBody& stream) {
    const bool uses_gzip = may_gzip();
    if (uses_gzip) {
      announce_gzip();
      stream.bytes.reset();
    }
    // Without chunks and length, the end of the connection ends the body.
    written_.keep_alive =
        written_.keep_alive && (context_.is_http_1_1 || !has_body_ || stream.bytes);
    if (!channel_.write({make_head(stream.bytes)}) || !has_body_) {
      written_.is_complete = !has_body_;
      return;
    }
    BodyStreamWriter writer(channel_, context_.watch_client(), context_.watch);
    if (context_.is_http_1_1 && !stream.bytes) {
      writer.use_chunks();
    }
    if (uses_gzip) {
      writer.use_gzip();
    }
    try {
      stream.producer(writer);
      written_.is_complete =
          writer.finish() && (!stream.bytes || writer.body_bytes() == *stream.bytes);
    } catch (const std::exception& error) {
      written_.internal_error = error.what();
    } catch (...) {
      written_.internal_error = "unknown exception";
    }
    written_.body_bytes = writer.body_bytes();
  }

  Channel& channel_;
  Response& response_;
  const WriteContext& context_;
  Written written_;
  bool has_body_ = true;
};

}  // namespace

Written write_response(Channel& channel, Response& response, const WriteContext& context) {
  return ResponseWriter(channel, response, context).write();
}

}  // namespace server
