#include "server/http/web_post.h"

#include <arpa/inet.h>
#include <httplib.h>
#include <netdb.h>
#include <netinet/in.h>

#include <algorithm>
#include <array>
#include <condition_variable>
#include <cstring>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

#include "server/http/text.h"

namespace server {
namespace {

constexpr std::size_t kAnswerBytesMax = 64U << 10U;

struct Net4 {
  std::uint32_t address;
  int bits;
};
/// What is not on the public internet. Source: IANA IPv4 Special-Purpose Address Registry.
constexpr std::array kSpecial4 = {
    Net4{0x00000000, 8},  Net4{0x0a000000, 8},  Net4{0x64400000, 10}, Net4{0x7f000000, 8},
    Net4{0xa9fe0000, 16}, Net4{0xac100000, 12}, Net4{0xc0000000, 24}, Net4{0xc0000200, 24},
    Net4{0xc0a80000, 16}, Net4{0xc6120000, 15}, Net4{0xc6336400, 24}, Net4{0xcb007100, 24},
    Net4{0xe0000000, 4},  Net4{0xf0000000, 4},
};

bool is_public4(std::uint32_t address) {
  return std::none_of(kSpecial4.begin(), kSpecial4.end(), [address](const Net4& net) {
    return (address >> static_cast<unsigned>(32 - net.bits)) ==
           (net.address >> static_cast<unsigned>(32 - net.bits));
  });
}

std::uint32_t word(const in6_addr& address, std::size_t first) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    value = value << 8U | address.s6_addr[first + i];
  }
  return value;
}

/// Source: IANA IPv6 Special-Purpose Address Registry; of the rest only 2000::/3 is given out.
bool is_public6(const in6_addr& address) {
  const std::uint32_t first = word(address, 0);
  const bool rest_is_zero = word(address, 4) == 0 && word(address, 8) == 0;
  if (first == 0 && word(address, 4) == 0 && word(address, 8) == 0xffff) {
    return is_public4(word(address, 12));  // ::ffff:a.b.c.d
  }
  if (first == 0x0064ff9b && rest_is_zero) {
    return is_public4(word(address, 12));  // NAT64
  }
  if (first >> 16U == 0x2002) {
    return is_public4((first & 0xffffU) << 16U | word(address, 4) >> 16U);  // 6to4
  }
  const bool is_global = first >> 29U == 1;
  const bool is_documentation = first == 0x20010db8 || first >> 20U == 0x3ff;
  const bool is_protocol = first >> 9U == 0x20010000U >> 9U;  // 2001::/23, Teredo among them
  return is_global && !is_documentation && !is_protocol;
}

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};

/// The first address of the host, as numbers. All of them must be public where that is asked.
core::Result<std::string> resolve(const WebTarget& target, Reach reach) {
  addrinfo hints = {};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* raw = nullptr;
  const std::string port = std::to_string(target.port);
  const int failed = ::getaddrinfo(target.host.c_str(), port.c_str(), &hints, &raw);
  const std::unique_ptr<addrinfo, FreeAddresses> list(raw);
  if (failed != 0) {
    return core::Error{core::ErrorCode::kUnavailable,
                       "cannot resolve " + target.host + ": " + ::gai_strerror(failed), ""};
  }
  std::string first;
  for (const addrinfo* entry = list.get(); entry != nullptr; entry = entry->ai_next) {
    std::array<char, NI_MAXHOST> text = {};
    if (::getnameinfo(entry->ai_addr, entry->ai_addrlen, text.data(), text.size(), nullptr, 0,
                      NI_NUMERICHOST) != 0) {
      continue;
    }
    if (reach == Reach::kPublicOnly && !is_public_address(text.data())) {
      return core::Error{core::ErrorCode::kForbidden,
                         target.host + " is " + text.data() + ", which is not on the public internet",
                         ""};
    }
    first = first.empty() ? text.data() : first;
  }
  if (first.empty()) {
    return core::Error{core::ErrorCode::kUnavailable, target.host + " has no address", ""};
  }
  return first;
}

/// Closes the client's connection when the time is over: the library's own limits are for each read.
class Deadline {
 public:
  Deadline(httplib::ClientImpl& client, std::chrono::seconds time)
      : watcher_([&client, time](const std::stop_token& stop) {
          std::mutex mutex;
          std::condition_variable_any never;
          std::unique_lock<std::mutex> lock(mutex);
          never.wait_for(lock, stop, time, [] { return false; });
          if (!stop.stop_requested()) {
            client.stop();
          }
        }) {}

 private:
  std::jthread watcher_;
};

template <typename Client>
core::Result<int> send(Client& client, const WebTarget& target, const WebPost& post,
                       const std::string& address) {
  client.set_hostname_addr_map({{target.host, address}});
  client.set_follow_location(false);
  client.set_connection_timeout(post.timeout.count());
  client.set_read_timeout(post.timeout.count());
  client.set_write_timeout(post.timeout.count());
  httplib::Request request;
  request.method = "POST";
  request.path = target.path;
  for (const auto& [name, value] : post.headers) {
    request.set_header(name, value);
  }
  request.set_header("Content-Type", post.content_type);
  request.body = post.body;
  int status = 0;
  std::size_t received = 0;
  request.response_handler = [&status](const httplib::Response& response) {
    status = response.status;
    return true;
  };
  request.content_receiver = [&received](const char* /*data*/, std::size_t size,
                                         std::uint64_t /*offset*/, std::uint64_t /*total*/) {
    received += size;
    return received <= kAnswerBytesMax;
  };
  httplib::Response response;
  httplib::Error error = httplib::Error::Success;
  {
    const Deadline deadline(client, post.timeout);
    const std::stop_callback cut(post.stop, [&client] { client.stop(); });
    // The handler is not called for an answer without a body, as 204 is.
    if (client.send(request, response, error)) {
      status = response.status;
    }
  }
  if (status != 0) {
    return status;
  }
  return core::Error{core::ErrorCode::kUnavailable, "no answer: " + httplib::to_string(error), ""};
}

}  // namespace

std::optional<WebTarget> parse_web_target(std::string_view url) {
  WebTarget target;
  if (url.substr(0, 8) == "https://") {
    target.is_tls = true;
    target.port = 443;
    url.remove_prefix(8);
  } else if (url.substr(0, 7) == "http://") {
    url.remove_prefix(7);
  } else {
    return std::nullopt;
  }
  const std::size_t end = std::min(url.find_first_of("/?"), url.size());
  std::string_view authority = url.substr(0, end);
  const std::string_view rest = url.substr(end);
  target.path = rest.empty() || rest.front() != '/' ? "/" + std::string(rest) : std::string(rest);
  std::string_view port;
  if (!authority.empty() && authority.front() == '[') {
    const std::size_t close = authority.find(']');
    if (close == std::string_view::npos) {
      return std::nullopt;
    }
    port = authority.substr(close + 1);
    target.host = authority.substr(1, close - 1);
  } else {
    const std::size_t colon = std::min(authority.find(':'), authority.size());
    port = authority.substr(colon);
    target.host = authority.substr(0, colon);
  }
  if (!port.empty()) {
    const auto number = port.front() == ':' ? parse_decimal(port.substr(1)) : std::nullopt;
    if (!number || *number == 0 || *number > 65535) {
      return std::nullopt;
    }
    target.port = static_cast<int>(*number);
  }
  return target.host.empty() ? std::nullopt : std::optional<WebTarget>(std::move(target));
}

bool is_public_address(std::string_view address) {
  const std::string text(address.substr(0, address.find('%')));
  in_addr v4 = {};
  if (::inet_pton(AF_INET, text.c_str(), &v4) == 1) {
    return is_public4(ntohl(v4.s_addr));
  }
  in6_addr v6 = {};
  return ::inet_pton(AF_INET6, text.c_str(), &v6) == 1 && is_public6(v6);
}

bool is_private_literal(std::string_view host) {
  if (equal_ignoring_case(host, "localhost") ||
      (host.size() > 10 && equal_ignoring_case(host.substr(host.size() - 10), ".localhost"))) {
    return true;
  }
  // As the resolver reads numbers, "127.1" and "0x7f000001" too.
  in_addr v4 = {};
  if (::inet_aton(std::string(host).c_str(), &v4) != 0) {
    return !is_public4(ntohl(v4.s_addr));
  }
  return host.find(':') != std::string_view::npos && !is_public_address(host);
}

core::Result<int> post_to_web(const WebTarget& target, const WebPost& post) {
  const auto address = resolve(target, post.reach);
  if (!address) {
    return address.error();
  }
  if (target.is_tls) {
    httplib::SSLClient client(target.host, target.port);
    client.enable_server_certificate_verification(true);
    return send(client, target, post, *address);
  }
  httplib::ClientImpl client(target.host, target.port);
  return send(client, target, post, *address);
}

}  // namespace server
