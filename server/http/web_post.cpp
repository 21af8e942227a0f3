#include "server/http/web_post.h"

#include <algorithm>
#include <array>
#include <span>

#include <arpa/inet.h>
#include <curl/curl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include "core/base/byte_order.h"
#include "core/base/check.h"
#include "server/http/text.h"

namespace server {
namespace {

constexpr std::size_t kAnswerBytesMax = 64U << 10U;

struct Net4 {
  std::uint32_t address;
  int bits;
};
/// Addresses outside the public internet. Source: IANA IPv4 Special-Purpose Address Registry.
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
  return core::u32_big(std::as_bytes(std::span(address.s6_addr)), first);
}

/// Source: IANA IPv6 Special-Purpose Address Registry; otherwise only 2000::/3 is assigned.
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
  const bool is_protocol = first >> 9U == 0x20010000U >> 9U;  // 2001::/23, including Teredo
  return is_global && !is_documentation && !is_protocol;
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
  // Parses numbers like the resolver, including "127.1" and "0x7f000001".
  in_addr v4 = {};
  if (::inet_aton(std::string(host).c_str(), &v4) != 0) {
    return !is_public4(ntohl(v4.s_addr));
  }
  return host.find(':') != std::string_view::npos && !is_public_address(host);
}

struct WebCalls::Call {
  struct Free {
    void operator()(CURL* handle) const { curl_easy_cleanup(handle); }
    void operator()(curl_slist* list) const { curl_slist_free_all(list); }
  };
  std::string id;
  WebPost post;
  std::string refused;  ///< A non-public address that was refused.
  std::size_t answer_bytes = 0;
  std::unique_ptr<curl_slist, Free> headers;
  std::unique_ptr<CURL, Free> handle;  // The last member: it uses the others.

  /// Called by libcurl with the address that it is about to connect to.
  static curl_socket_t open_socket(void* self, curlsocktype /*purpose*/, curl_sockaddr* address) {
    auto& call = *static_cast<Call*>(self);
    std::array<char, NI_MAXHOST> text = {};
    const int failed = ::getnameinfo(&address->addr, address->addrlen, text.data(), text.size(),
                                     nullptr, 0, NI_NUMERICHOST);
    if (call.post.reach == Reach::kPublicOnly && (failed != 0 || !is_public_address(text.data()))) {
      call.refused = text.data();
      return CURL_SOCKET_BAD;
    }
    return ::socket(address->family, address->socktype | SOCK_CLOEXEC, address->protocol);
  }

  static std::size_t take_answer(const char* /*bytes*/, std::size_t size, std::size_t count,
                                 void* self) {
    auto& call = *static_cast<Call*>(self);
    call.answer_bytes += size * count;
    return call.answer_bytes <= kAnswerBytesMax ? size * count : 0;
  }

  core::Result<int> status(CURLcode code) const {
    if (!refused.empty()) {
      const auto target = parse_web_target(post.url);
      return core::Error{core::ErrorCode::kForbidden,
                         (target ? target->host : post.url) + " is " + refused +
                             ", a private address; start the server with --webhook-private to "
                             "allow it",
                         ""};
    }
    long answered = 0;
    curl_easy_getinfo(handle.get(), CURLINFO_RESPONSE_CODE, &answered);
    // A response that exceeds the read limit still counts as one.
    const bool is_cut = code == CURLE_WRITE_ERROR && answer_bytes > kAnswerBytesMax;
    if (answered != 0 && (code == CURLE_OK || is_cut)) {
      return static_cast<int>(answered);
    }
    return core::Error{core::ErrorCode::kUnavailable,
                       std::string("no answer: ") + curl_easy_strerror(code), ""};
  }
};

void WebCalls::Free::operator()(void* multi) const { curl_multi_cleanup(multi); }

WebCalls::WebCalls() {
  CHECK(curl_global_init(CURL_GLOBAL_DEFAULT) == CURLE_OK);
  multi_.reset(curl_multi_init());
  CHECK(multi_ != nullptr);
}

WebCalls::~WebCalls() {
  for (const auto& call : calls_) {
    curl_multi_remove_handle(multi_.get(), call->handle.get());
  }
}

void WebCalls::begin(std::string id, const WebPost& post) {
  auto call = std::make_unique<Call>();
  call->id = std::move(id);
  call->post = post;
  call->handle.reset(curl_easy_init());
  CHECK(call->handle != nullptr);
  CURL* handle = call->handle.get();
  curl_slist* headers = curl_slist_append(nullptr, "Expect:");  // Avoids the pause before the body.
  for (const auto& [name, value] : post.headers) {
    headers = curl_slist_append(headers, (name + ": " + value).c_str());
  }
  call->headers.reset(headers);
  const auto set = [handle](CURLoption option, auto value) {
    CHECK(curl_easy_setopt(handle, option, value) == CURLE_OK);
  };
  set(CURLOPT_URL, call->post.url.c_str());
  set(CURLOPT_PROTOCOLS_STR, "http,https");
  set(CURLOPT_HTTP_VERSION, long{CURL_HTTP_VERSION_1_1});
  const auto target = parse_web_target(call->post.url);
  if (post.reach == Reach::kPublicOnly || !target || is_private_literal(target->host)) {
    set(CURLOPT_PROXY, "");  // Otherwise that of the environment.
  }
  set(CURLOPT_FOLLOWLOCATION, 0L);
  set(CURLOPT_FORBID_REUSE, 1L);
  set(CURLOPT_DNS_CACHE_TIMEOUT, 0L);
  set(CURLOPT_NOSIGNAL, 1L);
  set(CURLOPT_QUICK_EXIT, 1L);  // Otherwise the end of a call waits for the name lookup.
  set(CURLOPT_TIMEOUT_MS, static_cast<long>(post.timeout.count()));
  set(CURLOPT_CONNECTTIMEOUT_MS, static_cast<long>(post.timeout.count()));
  set(CURLOPT_POST, 1L);
  set(CURLOPT_POSTFIELDS, call->post.body.c_str());
  set(CURLOPT_POSTFIELDSIZE, static_cast<long>(call->post.body.size()));
  set(CURLOPT_HTTPHEADER, headers);
  set(CURLOPT_OPENSOCKETFUNCTION, &Call::open_socket);
  set(CURLOPT_OPENSOCKETDATA, call.get());
  set(CURLOPT_WRITEFUNCTION, &Call::take_answer);
  set(CURLOPT_WRITEDATA, call.get());
  CHECK(curl_multi_add_handle(multi_.get(), handle) == CURLM_OK);
  calls_.push_back(std::move(call));
}

std::vector<WebCalls::Ended> WebCalls::wait(std::chrono::milliseconds time) {
  int running = 0;
  curl_multi_perform(multi_.get(), &running);
  if (static_cast<std::size_t>(running) == calls_.size()) {
    curl_multi_poll(multi_.get(), nullptr, 0, static_cast<int>(time.count()), nullptr);
    curl_multi_perform(multi_.get(), &running);
  }
  std::vector<Ended> ended;
  int left = 0;
  while (const CURLMsg* message = curl_multi_info_read(multi_.get(), &left)) {
    const auto found = std::find_if(calls_.begin(), calls_.end(), [&](const auto& call) {
      return call->handle.get() == message->easy_handle;
    });
    if (message->msg != CURLMSG_DONE || found == calls_.end()) {
      continue;
    }
    ended.push_back({.id = (*found)->id, .status = (*found)->status(message->data.result)});
    curl_multi_remove_handle(multi_.get(), (*found)->handle.get());
    calls_.erase(found);
  }
  return ended;
}

void WebCalls::wake() { curl_multi_wakeup(multi_.get()); }

}  // namespace server
