/// TLS: the server's certificate, and a Channel that speaks TLS 1.2 or 1.3 over an accepted socket.
#pragma once

#include <memory>
#include <string>

#include "core/base/result.h"
#include "server/http/channel.h"

struct ssl_ctx_st;
struct ssl_st;

namespace server {

class TlsContext {
 public:
  /// Both files are PEM; the certificate file may hold the chain. Errors: kInvalidArgument with the
  /// file as `where` when it cannot be read or the two do not match.
  static core::Result<std::shared_ptr<const TlsContext>> load(const std::string& certificate_file,
                                                              const std::string& key_file);
  ~TlsContext();
  TlsContext(const TlsContext&) = delete;
  TlsContext& operator=(const TlsContext&) = delete;

  ssl_ctx_st* get() const { return context_; }

 private:
  explicit TlsContext(ssl_ctx_st* context) : context_(context) {}
  ssl_ctx_st* context_;
};

/// Borrows the descriptor and makes it non-blocking. The handshake is part of the first read, under
/// its deadline.
class TlsChannel final : public Channel {
 public:
  TlsChannel(const TlsContext& context, int fd, Pace pace);
  ~TlsChannel() override;
  TlsChannel(const TlsChannel&) = delete;
  TlsChannel& operator=(const TlsChannel&) = delete;

  Read read(char* into, std::size_t capacity, Clock::time_point deadline) override;
  Read read_idle(char* into, std::size_t capacity, std::chrono::milliseconds timeout) override;
  bool write(std::initializer_list<std::string_view> pieces) override;
  bool write_file(int file_fd, std::uint64_t offset, std::uint64_t size) override;
  void restart_pace() override;
  void finish_writing() override;
  int fd() const override { return fd_; }

 private:
  bool write_all(std::string_view bytes);
  /// Waits, within the pace, for the condition that the library requested. Returns false on
  /// failure.
  bool wait_to_write(int result);

  int fd_;
  WriteMeter meter_;
  ssl_st* tls_;
  bool has_failed_ = false;
};

}  // namespace server
