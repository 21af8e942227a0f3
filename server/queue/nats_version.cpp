// Address and version of a NATS server.
#include <array>
#include <charconv>
#include <optional>
#include <string>

#include <netdb.h>
#include <sys/socket.h>
#include <sys/time.h>

#include "core/base/descriptor.h"
#include "core/base/shown_address.h"
#include "server/queue/nats_link.h"

namespace queue {
namespace {

using core::Error;
using core::ErrorCode;

struct Endpoint {
  std::string host;
  std::string port = "4222";  // the port registered for NATS with IANA
};

std::optional<Endpoint> endpoint_of(std::string_view url) {
  const std::size_t scheme = url.find("://");
  const std::string_view kind = url.substr(0, scheme == std::string_view::npos ? 0 : scheme);
  if (kind != "nats" && kind != "tls") {
    return std::nullopt;
  }
  url.remove_prefix(scheme + 3);
  if (const std::size_t user = url.rfind('@'); user != std::string_view::npos) {
    url.remove_prefix(user + 1);
  }
  Endpoint endpoint;
  const std::size_t bracket = url.starts_with('[') ? url.find(']') : std::string_view::npos;
  const std::size_t colon = url.find(':', bracket == std::string_view::npos ? 0 : bracket);
  endpoint.host =
      bracket == std::string_view::npos ? url.substr(0, colon) : url.substr(1, bracket - 1);
  if (colon != std::string_view::npos) {
    endpoint.port = url.substr(colon + 1);
  }
  const bool is_number =
      !endpoint.port.empty() && endpoint.port.find_first_not_of("0123456789") == std::string::npos;
  return endpoint.host.empty() || !is_number ? std::nullopt : std::optional(endpoint);
}

}  // namespace

core::Result<std::string> host_and_port(const std::string& url) {
  if (const auto endpoint = endpoint_of(url)) {
    return endpoint->host + ":" + endpoint->port;
  }
  return Error{ErrorCode::kInvalidArgument,
               "\"" + core::shown_address(url) +
                   "\" is not an address of a NATS server such as nats://HOST:4222",
               ""};
}

core::Status check_version(std::string_view version) {
  std::array<int, 3> parts{};
  const char* at = version.data();
  const char* end = version.data() + version.size();
  for (int& part : parts) {
    const auto read = std::from_chars(at, end, part);
    at = read.ptr < end ? read.ptr + 1 : read.ptr;
  }
  constexpr int kRepaired = 23;
  if (parts[0] == 2 && parts[1] == 10 && parts[2] < kRepaired) {
    return Error{ErrorCode::kInvalidArgument,
                 "nats-server " + std::string(version) +
                     " is not supported: versions 2.10.0 to 2.10.22 may lose a stream when their "
                     "process ends; use 2.10.23 or newer, or 2.9",
                 ""};
  }
  return core::ok_status();
}

core::Result<std::string> server_version(const std::string& url) {
  const auto endpoint = endpoint_of(url);
  if (!endpoint) {
    return host_and_port(url).error();
  }
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(endpoint->host.c_str(), endpoint->port.c_str(), &hints, &found) != 0) {
    return Error{ErrorCode::kUnavailable, "the host \"" + endpoint->host + "\" is not known", ""};
  }
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> list(found, &::freeaddrinfo);
  for (const addrinfo* each = found; each != nullptr; each = each->ai_next) {
    const core::UniqueFd socket(::socket(each->ai_family, each->ai_socktype | SOCK_CLOEXEC, 0));
    const timeval patience{.tv_sec = 2, .tv_usec = 0};
    if (socket.get() < 0 ||
        ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) != 0 ||
        ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience) != 0 ||
        ::connect(socket.get(), each->ai_addr, each->ai_addrlen) != 0) {
      continue;
    }
    // "INFO {...,"version":"2.9.10",...}\r\n", a few hundred bytes.
    std::string line;
    constexpr std::size_t kLineMax = 65536;
    while (line.find('\n') == std::string::npos && line.size() < kLineMax) {
      std::array<char, 1024> piece{};
      const auto got = ::recv(socket.get(), piece.data(), piece.size(), 0);
      if (got <= 0) {
        break;
      }
      line.append(piece.data(), static_cast<std::size_t>(got));
    }
    constexpr std::string_view kName = "\"version\":\"";
    const std::size_t begin = line.find(kName);
    if (!line.starts_with("INFO ") || begin == std::string::npos) {
      return std::string();
    }
    const std::size_t first = begin + kName.size();
    return line.substr(first, line.find('"', first) - first);
  }
  return Error{ErrorCode::kUnavailable,
               "no NATS server answers at " + endpoint->host + ":" + endpoint->port, ""};
}

}  // namespace queue
