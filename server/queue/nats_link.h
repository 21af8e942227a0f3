/// NatsLink: a connection to a NATS server, reopened whenever it breaks. Its folder is the only
/// user of the NATS library.
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
  std::string
      ca;  ///< PEM file that verifies the server's certificate; empty: the system's certificates
};

/// Returns HOST:PORT. Errors: kInvalidArgument for an invalid address.
core::Result<std::string> host_and_port(const std::string& url);
/// Refuses versions whose JetStream loses streams when its process is killed. "" means unknown and
/// is accepted. Source: release notes of nats-server 2.10.23, which fixes it.
core::Status check_version(std::string_view version);
/// Returns the version that the server reports on connecting; "" if it reports none in plain text.
/// Errors: kUnavailable.
core::Result<std::string> server_version(const std::string& url);

class NatsLink {
 public:
  /// Returns a link without a connection if the server is unreachable, and keeps trying. Errors:
  /// kInvalidArgument (address, credentials, certificates).
  static core::Result<std::shared_ptr<NatsLink>> open(const Address& address,
                                                      const std::string& name);
  ~NatsLink();
  NatsLink(const NatsLink&) = delete;
  NatsLink& operator=(const NatsLink&) = delete;

  bool is_connected() const;
  /// Returns a number that changes after each reconnection.
  std::uint64_t generation() const { return generation_; }
  const std::string& url() const { return url_; }
  /// Returns HOST:PORT.
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
