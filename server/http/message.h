/// One HTTP exchange as routes see it: Request, BodyReader, Response, StreamWriter.
///
/// A handler is called on its connection's thread and may block, but every wait in it must end when
/// Request::stop_token() asks for it. What it throws becomes a 500 without its text.
/// Tests make a Request by filling the members; nothing in it needs a socket.
#pragma once

#include <cstddef>
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

/// Header fields in order of arrival; names compare without case.
class Headers {
 public:
  struct Field {
    std::string name;
    std::string value;
  };

  /// The first value of that name.
  std::optional<std::string_view> find(std::string_view name) const;
  /// All values of that name, joined by ", "; empty optional if there is none.
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

/// The body of an upload, read piece by piece; memory does not grow with it.
class BodyReader {
 public:
  /// Returns false to end the reading early (disk full, wrong content).
  using Sink = std::function<bool(std::string_view piece)>;

  virtual ~BodyReader() = default;

  /// Reads to the end of the body, piece by piece (each at most 64 KiB). True: the sink has seen
  /// all of it. False: the sink refused, or the body was too large, too slow, malformed or cut off;
  /// in these other cases the server answers 413, 408 or 400 whatever the handler returns.
  virtual bool read(const Sink& sink) = 0;

  /// Body bytes handed out so far, without transfer framing.
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
  /// Numeric address of the client, without port; behind a trusted proxy the one it names.
  std::string remote_addr;
  bool is_https = false;   ///< The client speaks TLS, with us or with a trusted proxy.
  std::string request_id;  ///< The client's X-Request-Id if it is well-formed, else a fresh one.
  std::string route;       ///< Pattern of the matched route, for metrics; empty if none.
  std::string principal;   ///< Id of the key that asks; left to the before-hook to fill.
  std::string principal_name = {};    ///< For people; the same.
  Access access = {};                 ///< Whose things it may see; the same.
  std::string body;                   ///< The whole body on routes with BodyPolicy::json.
  BodyReader* body_reader = nullptr;  ///< Set on routes with BodyPolicy::stream.
  /// Made by the server; called by stop_token().
  std::function<std::stop_token()> watch_client;
  /// The place that this request has among those of its key that are being answered; set by the
  /// server. A long poll changes it for a place among the streams.
  StreamSlot* place = nullptr;

  /// First query parameter of that name.
  std::optional<std::string> query(std::string_view name) const;
  /// First header of that name; the view lives as long as the request.
  std::optional<std::string_view> header(std::string_view name) const { return headers.find(name); }
  /// A `{name}` of the route's pattern; empty if an optional suffix was not given.
  std::string_view path_param(std::string_view name) const;
  /// Asks for a stop when the client has gone (seen within a second) or the server ends. For waits:
  /// `cond.wait_for(mutex, request.stop_token(), timeout, predicate)`. The first call has a cost.
  std::stop_token stop_token() const { return watch_client ? watch_client() : std::stop_token(); }
};

/// Given to the producer of a streamed body; valid during that call only.
class StreamWriter {
 public:
  virtual ~StreamWriter() = default;

  /// Sends now. Blocks while the client reads slowly; false once it is gone, stalled, or cut off by
  /// the end of the server: the producer must then return.
  virtual bool write(std::string_view bytes) = 0;
  /// The client closed its connection or stalled.
  virtual bool client_gone() const = 0;
  /// The server ends: say goodbye in one write and return.
  virtual bool stopping() const = 0;
  /// Asks for a stop in both cases, and wakes a wait on it. Same token as Request::stop_token().
  virtual std::stop_token stop_token() const = 0;
};

class StreamGate;

/// One place among the limited number of streams; given back by the destructor.
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
  StreamSlot slot = {};     ///< Taken by the server itself if empty; 503 if there is none.
  /// How much the producer writes, if that is known: the Content-Length.
  std::optional<std::uint64_t> bytes = {};
};

/// A piece of an open file. The descriptor is owned.
class FileBody {
 public:
  FileBody(int fd, std::uint64_t offset, std::uint64_t size)
      : fd_(fd), offset_(offset), size_(size) {}
  /// The same file, another piece of it.
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

/// Content-Length, Transfer-Encoding, Connection, Date and X-Request-Id are the server's business;
/// the body of an answer to HEAD, of 204 and of 304 is dropped there.
struct Response {
  int status = 200;
  Headers headers;
  std::variant<std::string, SharedBytes, FileBody, StreamBody> body;
  /// For text of some size: gzip when the client accepts it.
  bool compressible = false;
};

/// application/json; the text is sent as it is. A status of 4xx or 5xx is for api/errors to make.
Response json_response(int status, std::string json);
Response text_response(int status, std::string_view content_type, std::string text);
Response bytes_response(int status, std::string_view content_type, SharedBytes bytes);
/// Cache-Control: no-store and X-Accel-Buffering: no are added.
Response stream_response(std::string_view content_type, StreamProducer producer,
                         StreamSlot slot = {});
/// 204 without a body.
Response empty_response(int status = 204);

}  // namespace server
