#include "server/http/client_address.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "core/base/shown_address.h"
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

/// What a proxy says of the request that it received. Texts that it does not say are empty.
struct Hop {
  std::string client;
  std::string scheme;
  std::string host;
};

/// Parses `for=192.0.2.60;proto=https;host="a.example:8443"` (RFC 7239, 4).
Hop parse_forwarded(std::string_view element) {
  Hop hop;
  while (!element.empty()) {
    const std::string_view pair = trim(element.substr(0, element.find(';')));
    element.remove_prefix(std::min(element.find(';'), element.size() - 1) + 1);
    const std::size_t equals = std::min(pair.find('='), pair.size());
    std::string_view value = pair.substr(std::min(equals + 1, pair.size()));
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"') {
      value = value.substr(1, value.size() - 2);
    }
    const std::string_view name = pair.substr(0, equals);
    if (equal_ignoring_case(name, "for")) {
      hop.client = value;
    } else if (equal_ignoring_case(name, "proto")) {
      hop.scheme = value;
    } else if (equal_ignoring_case(name, "host")) {
      hop.host = value;
    }
  }
  return hop;
}

/// Returns the value of the field that the i-th hop from the right added. A field with one value
/// was set by the first proxy and passed on by all.
std::string value_of_hop(const std::vector<std::string_view>& values, std::size_t from_right) {
  if (values.empty()) {
    return {};
  }
  return std::string(values.size() == 1 || from_right >= values.size()
                         ? values.front()
                         : values[values.size() - 1 - from_right]);
}

/// Returns what the proxies say, the nearest one last.
std::vector<Hop> forwarded_hops(const Headers& headers) {
  std::vector<Hop> hops;
  if (const auto forwarded = headers.joined("Forwarded")) {
    for (const std::string_view element : split_list(*forwarded)) {
      hops.push_back(parse_forwarded(element));
    }
    return hops;
  }
  const auto list_of = [&headers](const char* name) { return headers.joined(name).value_or(""); };
  const std::string clients = list_of("X-Forwarded-For");
  const std::string schemes = list_of("X-Forwarded-Proto");
  const std::string hosts = list_of("X-Forwarded-Host");
  const std::string ports = list_of("X-Forwarded-Port");
  const auto client_list = split_list(clients);
  const std::size_t count = std::max<std::size_t>(client_list.size(), 1);
  for (std::size_t i = count; i-- > 0;) {
    Hop hop;
    hop.client = client_list.empty() ? "" : std::string(client_list[count - 1 - i]);
    hop.scheme = value_of_hop(split_list(schemes), i);
    hop.host = value_of_hop(split_list(hosts), i);
    const std::string port = value_of_hop(split_list(ports), i);
    const bool has_port =
        hop.host.rfind(':') > hop.host.rfind(']') + 1 && hop.host.rfind(':') != std::string::npos;
    if (!hop.host.empty() && !port.empty() && !has_port) {
      hop.host += ":" + port;
    }
    hops.push_back(std::move(hop));
  }
  return hops;
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
      return core::Error{
          core::ErrorCode::kInvalidArgument,
          "\"" + core::shown_address(text) + "\" is not a network such as 10.0.0.0/8 or fd00::/8",
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
  request.forwarded_host.clear();
  request.base_path.clear();
  if (!trusted.contains(peer)) {
    return;
  }
  if (const auto prefix = request.headers.find("X-Forwarded-Prefix")) {
    request.base_path = base_path(*prefix).value_or("");
  }
  std::vector<Hop> hops = forwarded_hops(request.headers);
  while (!hops.empty() && trusted.contains(request.remote_addr)) {
    const Hop& hop = hops.back();
    if (!hop.scheme.empty()) {
      request.is_https = equal_ignoring_case(hop.scheme, "https");
    }
    if (!hop.host.empty()) {
      request.forwarded_host = hop.host;
    }
    if (!hop.client.empty()) {
      const auto address = parse_hop(hop.client);
      if (!address) {
        return;
      }
      request.remote_addr = address_text(*address);
    }
    hops.pop_back();
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
