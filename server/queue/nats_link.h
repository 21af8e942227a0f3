/// NatsLink: a connection to a NATS server, made again whenever it breaks. With its folder the only
/// home of the NATS library.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace queue {

struct Address {
  std::string url;          ///< nats://[USER:PASSWORD@|TOKEN@]HOST[:PORT] or tls://...
  std::string credentials;  ///< file of a user's JWT and seed; empty: none
  std::string ca;           ///< PEM file that the server's certificate is checked with; empty: the
                            ///< machine's own
};

/// HOST:PORT. Errors: kInvalidArgument for a text that is no such address.
core::Result<std::string> host_and_port(const std::string& url);
/// Versions whose JetStream loses streams when its process is killed are refused. "" is not known,
/// and let through. Source: release notes of nats-server 2.10.23, which repairs it.
core::Status check_version(std::string_view version);
/// What the server at the address says on connecting; "" when it says nothing in plain text.
/// Errors: kUnavailable.
core::Result<std::string> server_version(const std::string& url);

class NatsLink {
 public:
  /// Comes back without a connection where there is no server yet: it goes on trying. Errors:
  /// kInvalidArgument (address, credentials, certificates).
  static core::Result<std::shared_ptr<NatsLink>> open(const Address& address,
                                                      const std::string& name);
  ~NatsLink();
  NatsLink(const NatsLink&) = delete;
  NatsLink& operator=(const NatsLink&) = delete;

  bool is_connected() const;
  /// Another number after each time that the connection was made anew.
  std::uint64_t generation() const { return generation_; }
  const std::string& url() const { return url_; }
  /// HOST:PORT.
  const std::string& name() const { return name_; }

 private:
  friend class UnitPublisher;
  friend class UnitPuller;
  friend class ReportRequests;
  struct Handles;
  NatsLink() = default;

  std::string url_;
  std::string name_;
  std::unique_ptr<Handles> handles_;
  std::atomic<std::uint64_t> generation_ = 1;
};

}  // namespace queue
