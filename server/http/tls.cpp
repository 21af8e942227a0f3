#include "server/http/tls.h"

#include <algorithm>
#include <array>
#include <cerrno>

#include <fcntl.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/base/check.h"

namespace server {
namespace {

/// One TLS record: longer writes are split anyway.
constexpr std::size_t kRecordBytes = 16U << 10U;

/// For TLS 1.2: forward secrecy and authenticated encryption only, as in TLS 1.3. Source: RFC 9325,
/// 4.2.
constexpr const char* kCiphers = "ECDHE+AESGCM:ECDHE+CHACHA20";

core::Error tls_error(const std::string& file) {
  std::array<char, 256> text = {};
  ERR_error_string_n(ERR_get_error(), text.data(), text.size());
  ERR_clear_error();
  return core::Error{core::ErrorCode::kInvalidArgument, text.data(), file};
}

/// Returns the events that poll() must wait for after that error; 0: waiting does not help.
short wanted_events(int error) {
  return error == SSL_ERROR_WANT_READ ? POLLIN : error == SSL_ERROR_WANT_WRITE ? POLLOUT : short{0};
}

}  // namespace

core::Result<std::shared_ptr<const TlsContext>> TlsContext::load(
    const std::string& certificate_file, const std::string& key_file) {
  SSL_CTX* raw = SSL_CTX_new(TLS_server_method());
  CHECK(raw != nullptr);
  const std::shared_ptr<const TlsContext> context(
      new TlsContext(raw));  // NOLINT: private constructor.
  SSL_CTX_set_min_proto_version(raw, TLS1_2_VERSION);
  CHECK(SSL_CTX_set_cipher_list(raw, kCiphers) == 1);
  SSL_CTX_set_options(raw, SSL_OP_NO_RENEGOTIATION | SSL_OP_CIPHER_SERVER_PREFERENCE);
  SSL_CTX_set_mode(raw, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                            SSL_MODE_RELEASE_BUFFERS);
  ERR_clear_error();
  if (SSL_CTX_use_certificate_chain_file(raw, certificate_file.c_str()) != 1) {
    return tls_error(certificate_file);
  }
  if (SSL_CTX_use_PrivateKey_file(raw, key_file.c_str(), SSL_FILETYPE_PEM) != 1 ||
      SSL_CTX_check_private_key(raw) != 1) {
    return tls_error(key_file);
  }
  return context;
}

TlsContext::~TlsContext() { SSL_CTX_free(context_); }

TlsChannel::TlsChannel(const TlsContext& context, int fd, Pace pace)
    : fd_(fd), meter_(pace), tls_(SSL_new(context.get())) {
  ::fcntl(fd, F_SETFL, ::fcntl(fd, F_GETFL) | O_NONBLOCK);
  has_failed_ = tls_ == nullptr || SSL_set_fd(tls_, fd) != 1;
  if (!has_failed_) {
    SSL_set_accept_state(tls_);
  }
}

TlsChannel::~TlsChannel() { SSL_free(tls_); }

Channel::Read TlsChannel::read(char* into, std::size_t capacity, Clock::time_point deadline) {
  while (!has_failed_) {
    ERR_clear_error();
    std::size_t bytes = 0;
    const int result = SSL_read_ex(tls_, into, capacity, &bytes);
    if (result == 1) {
      return {.status = Status::kOk, .bytes = bytes};
    }
    const int error = SSL_get_error(tls_, result);
    const short events = wanted_events(error);
    if (events == 0) {
      // After a fatal error the library must not be called again, not even for SSL_shutdown.
      has_failed_ = error != SSL_ERROR_ZERO_RETURN;
      break;
    }
    if (!poll_until(fd_, events, deadline)) {
      return {.status = Status::kTimeout};
    }
  }
  return {.status = Status::kClosed};
}

Channel::Read TlsChannel::read_idle(char* into, std::size_t capacity,
                                    std::chrono::milliseconds timeout) {
  return read(into, capacity, Clock::now() + timeout);
}

bool TlsChannel::wait_to_write(int result) {
  const short events = wanted_events(SSL_get_error(tls_, result));
  has_failed_ = events == 0 || !meter_.wait(fd_, events);
  return !has_failed_;
}

bool TlsChannel::write_all(std::string_view bytes) {
  while (!bytes.empty()) {
    if (has_failed_) {
      return false;
    }
    ERR_clear_error();
    std::size_t sent = 0;
    const int result =
        SSL_write_ex(tls_, bytes.data(), std::min(bytes.size(), kRecordBytes), &sent);
    if (result == 1) {
      bytes.remove_prefix(sent);
      meter_.add(sent);
    } else if (!wait_to_write(result)) {
      return false;
    }
  }
  return true;
}

bool TlsChannel::write(std::initializer_list<std::string_view> pieces) {
  std::string small;  // Pieces that fit into one record are joined.
  for (const std::string_view piece : pieces) {
    if (small.size() + piece.size() <= kRecordBytes) {
      small += piece;
      continue;
    }
    if (!write_all(small) || !write_all(piece)) {
      return false;
    }
    small.clear();
  }
  return write_all(small);
}

bool TlsChannel::write_file(int file_fd, std::uint64_t offset, std::uint64_t size) {
  std::string piece(4 * kRecordBytes, '\0');
  while (size > 0) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(size, piece.size()));
    const ssize_t got = ::pread(file_fd, piece.data(), wanted, static_cast<off_t>(offset));
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got <= 0 || !write_all(std::string_view(piece).substr(0, static_cast<std::size_t>(got)))) {
      return false;
    }
    offset += static_cast<std::uint64_t>(got);
    size -= static_cast<std::uint64_t>(got);
  }
  return true;
}

void TlsChannel::restart_pace() { meter_.restart(); }

void TlsChannel::finish_writing() {
  if (!has_failed_) {
    ERR_clear_error();
    SSL_shutdown(tls_);
  }
  ::shutdown(fd_, SHUT_WR);
}

}  // namespace server
