/// Address of a client: the peer of the connection or, behind a proxy that the operator trusts, the
/// client that this proxy names.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/http/message.h"

namespace server {

/// Networks in CIDR notation: `10.0.0.0/8`, `fd00::/8`; a bare address is a network of one.
class Networks {
 public:
  Networks() = default;
  /// Errors: kInvalidArgument for a text that is not a network, or has bits set beyond its prefix.
  static core::Result<Networks> parse(const std::vector<std::string>& texts);
  /// Also false for a text that is not an address.
  bool contains(std::string_view address) const;

 private:
  struct Network {
    std::array<std::uint8_t, 16> bytes{};  ///< IPv4 as ::ffff:a.b.c.d.
    int prefix_bits = 128;
  };
  std::vector<Network> networks_;
};

/// Returns the numeric address of the socket's peer, without port; empty when it has none.
/// IPv4-mapped addresses are returned as IPv4.
std::string peer_address(int fd);

/// Sets request.remote_addr, is_https, forwarded_host and, from X-Forwarded-Prefix, base_path.
/// X-Forwarded-For, -Proto, -Host and -Port, or Forwarded (RFC 7239) in their place, count only as
/// far as the hops that added them are trusted: the client is the first untrusted address from the
/// right, whose proxy, the one that received the client's request, also tells scheme and host.
void note_client(Request& request, std::string_view peer, bool is_tls, const Networks& trusted);

/// Returns the key by which connections are counted: an IPv4 address, or the first 64 bits of an
/// IPv6 address, the smallest block assigned to one customer (RFC 6177).
std::string address_group(const std::string& address);

}  // namespace server
