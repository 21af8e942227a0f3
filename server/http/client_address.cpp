#include "server/http/client_address.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "server/http/text.h"

namespace server {
namespace {

using Bytes = std::array<std::uint8_t, 16>;
constexpr Bytes kMappedV4 = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF};
constexpr int kMappedBits = 96;

bool is_mapped(const Bytes& bytes) {
  return std::equal(bytes.begin(), bytes.begin() + kMappedBits / 8, kMappedV4.begin());
}

std::optional<Bytes> parse_address(std::string_view text) {
  const std::string name(text);
  Bytes bytes = kMappedV4;
  if (::inet_pton(AF_INET, name.c_str(), bytes.data() + kMappedBits / 8) == 1 ||
      ::inet_pton(AF_INET6, name.c_str(), bytes.data()) == 1) {
    return bytes;
  }
  return std::nullopt;
}

std::string address_text(const Bytes& bytes) {
  std::array<char, INET6_ADDRSTRLEN> text = {};
  if (is_mapped(bytes)) {
    ::inet_ntop(AF_INET, bytes.data() + kMappedBits / 8, text.data(), text.size());
  } else {
    ::inet_ntop(AF_INET6, bytes.data(), text.data(), text.size());
  }
  return text.data();
}

void clear_from(Bytes& bytes, int bit) {
  for (int i = 0; i < 16; ++i) {
    const int kept = std::clamp(bit - 8 * i, 0, 8);
    bytes[static_cast<std::size_t>(i)] &= static_cast<std::uint8_t>(0xFF00U >> kept);
  }
}

/// Parses one entry of X-Forwarded-For; some proxies add the port.
std::optional<Bytes> parse_hop(std::string_view text) {
  if (!text.empty() && text.front() == '[') {
    return parse_address(text.substr(1, std::min(text.find(']'), text.size()) - 1));
  }
  if (std::count(text.begin(), text.end(), ':') == 1) {
    text = text.substr(0, text.find(':'));
  }
  return parse_address(text);
}

}  // namespace

core::Result<Networks> Networks::parse(const std::vector<std::string>& texts) {
  Networks networks;
  for (const std::string& text : texts) {
    const std::size_t slash = text.find('/');
    const auto bytes = parse_address(std::string_view(text).substr(0, slash));
    const bool is_v4 = bytes && is_mapped(*bytes);
    const int bits_before = is_v4 ? kMappedBits : 0;
    std::optional<std::uint64_t> prefix = static_cast<std::uint64_t>(128 - bits_before);
    if (slash != std::string::npos) {
      prefix = parse_decimal(std::string_view(text).substr(slash + 1));
    }
    Network network;
    if (bytes && prefix && *prefix <= static_cast<std::uint64_t>(128 - bits_before)) {
      network = {.bytes = *bytes, .prefix_bits = bits_before + static_cast<int>(*prefix)};
      clear_from(network.bytes, network.prefix_bits);
    }
    if (!bytes || !prefix || network.bytes != *bytes) {
      return core::Error{core::ErrorCode::kInvalidArgument,
                         "\"" + text + "\" is not a network such as 10.0.0.0/8 or fd00::/8",
                         {}};
    }
    networks.networks_.push_back(network);
  }
  return networks;
}

bool Networks::contains(std::string_view address) const {
  const auto bytes = networks_.empty() ? std::nullopt : parse_address(address);
  return bytes && std::any_of(networks_.begin(), networks_.end(), [&](const Network& network) {
           Bytes start = *bytes;
           clear_from(start, network.prefix_bits);
           return start == network.bytes;
         });
}

std::string peer_address(int fd) {
  sockaddr_storage storage = {};
  socklen_t length = sizeof(storage);
  if (::getpeername(fd, reinterpret_cast<sockaddr*>(&storage), &length) != 0) {
    return {};
  }
  Bytes bytes = kMappedV4;
  if (storage.ss_family == AF_INET) {
    const auto* v4 = reinterpret_cast<const sockaddr_in*>(&storage);
    std::memcpy(bytes.data() + kMappedBits / 8, &v4->sin_addr, sizeof(v4->sin_addr));
  } else if (storage.ss_family == AF_INET6) {
    const auto* v6 = reinterpret_cast<const sockaddr_in6*>(&storage);
    std::memcpy(bytes.data(), &v6->sin6_addr, sizeof(v6->sin6_addr));
  } else {
    return {};
  }
  return address_text(bytes);
}

void note_client(Request& request, std::string_view peer, bool is_tls, const Networks& trusted) {
  request.remote_addr = peer;
  request.is_https = is_tls;
  if (!trusted.contains(peer)) {
    return;
  }
  if (const auto scheme = request.headers.joined("X-Forwarded-Proto")) {
    const auto schemes = split_list(*scheme);
    request.is_https = !schemes.empty() && equal_ignoring_case(schemes.back(), "https");
  }
  const std::string hops = request.headers.joined("X-Forwarded-For").value_or("");
  std::vector<std::string_view> list = split_list(hops);
  while (!list.empty() && trusted.contains(request.remote_addr)) {
    const auto hop = parse_hop(list.back());
    if (!hop) {
      return;
    }
    request.remote_addr = address_text(*hop);
    list.pop_back();
  }
}

std::string address_group(const std::string& address) {
  auto bytes = parse_address(address);
  if (!bytes || is_mapped(*bytes)) {
    return address;
  }
  constexpr int kCustomerBits = 64;
  clear_from(*bytes, kCustomerBits);
  return address_text(*bytes) + "/64";
}

}  // namespace server
