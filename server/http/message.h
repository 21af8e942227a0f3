/// One HTTP exchange as handlers see it: Request, BodyReader, Response, StreamWriter.
///
/// A handler runs on its connection's thread and may block, but every wait must end when
/// Request::stop_token() requests a stop. An exception becomes a 500 without its text. Tests build
/// a Request by filling its members; it needs no socket.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "server/access.h"

namespace server {

/// Header fields in order of arrival; names are case-insensitive.
class Headers {
 public:
  struct Field {
    std::string name;
    std::string value;
  };

  /// Returns the first value of that name.
  std::optional<std::string_view> find(std::string_view name) const;
  /// Returns all values of that name, joined by ", "; empty if there is none.
  std::optional<std::string> joined(std::string_view name) const;
  bool contains(std::string_view name) const { return find(name).has_value(); }
  void add(std::string_view name, std::string_view value);
  /// Replaces all fields of that name by one.
  void set(std::string_view name, std::string_view value);
  void remove(std::string_view name);
  void clear() { fields_.clear(); }
  const std::vector<Field>& fields() const { return fields_; }

 private:
  std::vector<Field> fields_;
};

/// The body of an upload, read in pieces; memory does not grow with its size.
class BodyReader {
 public:
  /// Returns false to stop reading early (disk full, wrong content).
  using Sink = std::function<bool(std::string_view piece)>;

  virtual ~BodyReader() = default;

  /// Reads to the end of the body in pieces of at most 64 KiB. Returns true when the sink has
  /// received all of it. Returns false when the sink refused, or the body was too large, too slow,
  /// malformed or cut off; in the latter cases the server answers 413, 408 or 400 whatever the
  /// handler returns.
  virtual bool read(const Sink& sink) = 0;

  /// Body bytes delivered so far, without transfer framing.
  virtual std::uint64_t bytes_read() const = 0;
  /// Content-Length, if the client sent one.
  virtual std::optional<std::uint64_t> declared_bytes() const = 0;
};

/// For tests of handlers.
class StringBodyReader : public BodyReader {
 public:
  explicit StringBodyReader(std::string body) : body_(std::move(body)) {}
  bool read(const Sink& sink) override;
  std::uint64_t bytes_read() const override { return bytes_read_; }
  std::optional<std::uint64_t> declared_bytes() const override { return body_.size(); }

 private:
  std::string body_;
  std::uint64_t bytes_read_ = 0;
};

class StreamSlot;

struct Request {
  std::string method;  ///< Upper case as received: "GET", "HEAD", ...
  std::string target;  ///< As received: "/v1/jobs?limit=5".
  std::string path;    ///< Without query; percent-decoded.
  std::vector<std::pair<std::string, std::string>> query_params;  ///< Decoded, in order.
  std::vector<std::pair<std::string, std::string>> path_params;   ///< Decoded; from the router.
  Headers headers;
  /// Numeric address of the client, without port; behind a trusted proxy, the client that it names.
  std::string remote_addr;
  bool is_https = false;            ///< The client uses TLS to this server or to a trusted proxy.
  std::string forwarded_host = {};  ///< Host that the client asked a trusted proxy for; or empty.
  std::string base_path = {};  ///< Path below which a trusted proxy places this server: "/render".
  std::string request_id;      ///< The client's X-Request-Id if well-formed, else a new one.
  std::string route;           ///< Pattern of the matched route, for metrics; empty if none.
  std::string principal;       ///< Id of the caller's key; filled by the before-hook.
  std::string principal_name = {};    ///< Display name of the key; filled by the before-hook.
  Access access = {};                 ///< Rights of the caller; filled by the before-hook.
  bool is_of_worker = false;          ///< `tessera worker` sent it; filled by the before-hook.
  std::string body;                   ///< The whole body, on routes with BodyPolicy::json.
  BodyReader* body_reader = nullptr;  ///< Set on routes with BodyPolicy::stream.
  /// Set by the server; called by stop_token().
  std::function<std::stop_token()> watch_client;
  /// The request's slot among the requests in progress of its key; set by the server. A long poll
  /// exchanges it for a stream slot.
  StreamSlot* place = nullptr;

  /// Returns the first query parameter of that name.
  std::optional<std::string> query(std::string_view name) const;
  /// Returns the first header of that name; the view lives as long as the request.
  std::optional<std::string_view> header(std::string_view name) const { return headers.find(name); }
  /// Returns a `{name}` of the route's pattern; empty if an optional suffix was not given.
  std::string_view path_param(std::string_view name) const;
  /// Requests a stop when the client disconnects (seen within a second) or the server shuts down.
  /// For waits: `cond.wait_for(mutex, request.stop_token(), timeout, predicate)`. The first call
  /// registers a watch, which has a cost.
  std::stop_token stop_token() const { return watch_client ? watch_client() : std::stop_token(); }
};

/// Passed to the producer of a streamed body; valid only during that call.
class StreamWriter {
 public:
  virtual ~StreamWriter() = default;

  /// Sends now, and blocks while the client reads slowly. Returns false once the client is gone,
  /// stalled, or cut off by shutdown: the producer must then return.
  virtual bool write(std::string_view bytes) = 0;
  /// Returns whether the client closed its connection or stalled.
  virtual bool client_gone() const = 0;
  /// Returns whether the server is shutting down: send one last write and return.
  virtual bool stopping() const = 0;
  /// Requests a stop in both cases and wakes waits on it. Same token as Request::stop_token().
  virtual std::stop_token stop_token() const = 0;
};

class StreamGate;

/// One of a limited number of stream slots; released by the destructor.
class StreamSlot {
 public:
  StreamSlot() = default;
  StreamSlot(StreamSlot&& other) noexcept
      : gate_(std::exchange(other.gate_, nullptr)), owner_(std::move(other.owner_)) {}
  StreamSlot& operator=(StreamSlot&& other) noexcept {
    std::swap(gate_, other.gate_);
    std::swap(owner_, other.owner_);
    return *this;
  }
  StreamSlot(const StreamSlot&) = delete;
  StreamSlot& operator=(const StreamSlot&) = delete;
  ~StreamSlot();
  explicit operator bool() const { return gate_ != nullptr; }
  bool is_of(const StreamGate& gate) const { return gate_ == &gate; }

 private:
  friend class StreamGate;
  StreamSlot(StreamGate* gate, std::string owner) : gate_(gate), owner_(std::move(owner)) {}
  StreamGate* gate_ = nullptr;
  std::string owner_;
};

using StreamProducer = std::function<void(StreamWriter&)>;

struct StreamBody {
  StreamProducer producer;  ///< Not called for HEAD.
  StreamSlot slot = {};     ///< Taken by the server if empty; 503 if none is free.
  /// Content-Length, if the producer's size is known.
  std::optional<std::uint64_t> bytes = {};
};

/// A section of an open file. Owns the descriptor.
class FileBody {
 public:
  FileBody(int fd, std::uint64_t offset, std::uint64_t size)
      : fd_(fd), offset_(offset), size_(size) {}
  /// Returns another section of the same file.
  FileBody part(std::uint64_t offset, std::uint64_t size) &&;
  FileBody(FileBody&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)), offset_(other.offset_), size_(other.size_) {}
  FileBody& operator=(FileBody&& other) noexcept;
  FileBody(const FileBody&) = delete;
  FileBody& operator=(const FileBody&) = delete;
  ~FileBody();
  int fd() const { return fd_; }
  std::uint64_t offset() const { return offset_; }
  std::uint64_t size() const { return size_; }

 private:
  int fd_ = -1;
  std::uint64_t offset_ = 0;
  std::uint64_t size_ = 0;
};

using SharedBytes = std::shared_ptr<const std::string>;

/// The server sets Content-Length, Transfer-Encoding, Connection, Date and X-Request-Id, and drops
/// the body of responses to HEAD and with status 204 or 304.
struct Response {
  int status = 200;
  Headers headers;
  std::variant<std::string, SharedBytes, FileBody, StreamBody> body;
  /// Compress with gzip when the client accepts it and the text is long enough.
  bool compressible = false;
};

/// application/json with the text as given. For a status of 4xx or 5xx use api/errors.
Response json_response(int status, std::string json);
Response text_response(int status, std::string_view content_type, std::string text);
Response bytes_response(int status, std::string_view content_type, SharedBytes bytes);
/// Adds Cache-Control: no-store and X-Accel-Buffering: no.
Response stream_response(std::string_view content_type, StreamProducer producer,
                         StreamSlot slot = {});
/// 204 without a body.
Response empty_response(int status = 204);

}  // namespace server
