/// Who a client is by its address: the peer of the connection or, behind a proxy that the operator
/// trusts, whom that proxy names.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/http/message.h"

namespace server {

/// Networks in CIDR notation: `10.0.0.0/8`, `fd00::/8`; an address alone is itself.
class Networks {
 public:
  Networks() = default;
  /// Errors: kInvalidArgument for a text that is not a network, or has bits beyond its prefix.
  static core::Result<Networks> parse(const std::vector<std::string>& texts);
  /// False also for a text that is not an address.
  bool contains(std::string_view address) const;

 private:
  struct Network {
    std::array<std::uint8_t, 16> bytes{};  ///< IPv4 as ::ffff:a.b.c.d.
    int prefix_bits = 128;
  };
  std::vector<Network> networks_;
};

/// Numeric address of the socket's peer, without port; empty when it has none. IPv4 in its own
/// notation, however it came.
std::string peer_address(int fd);

/// Sets request.remote_addr and request.is_https. What X-Forwarded-For and X-Forwarded-Proto say
/// counts only as far as the hops that said it are trusted: from the right, the first address that
/// is not.
void note_client(Request& request, std::string_view peer, bool is_tls, const Networks& trusted);

/// What connections are counted by: an IPv4 address, or the first 64 bits of an IPv6 one, which is
/// the least that a single customer has (RFC 6177).
std::string address_group(const std::string& address);

}  // namespace server
