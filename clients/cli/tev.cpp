#include "clients/cli/tev.h"

#include <bit>
#include <cerrno>
#include <cstdint>
#include <memory>
#include <system_error>
#include <utility>

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

constexpr char kCreateImage = 4;
constexpr char kUpdateImage = 6;
constexpr int kPatienceSeconds = 10;

class Packet {
 public:
  explicit Packet(char operation) : bytes_(4, '\0') { bytes_ += operation; }

  void add_bool(bool value) { bytes_ += value ? '\1' : '\0'; }
  void add_int(std::int64_t value, std::size_t bytes) {
    for (std::size_t i = 0; i < bytes; ++i) {
      bytes_ += static_cast<char>(static_cast<std::uint64_t>(value) >> (8 * i) & 255U);
    }
  }
  void add_i32(int value) { add_int(value, 4); }
  void add_text(std::string_view text) {
    bytes_ += text;
    bytes_ += '\0';
  }
  void add_channels(std::span<const std::string_view> channels) {
    add_i32(static_cast<int>(channels.size()));
    for (const std::string_view channel : channels) {
      add_text(channel);
    }
  }

  std::string finished() && {
    for (std::size_t i = 0; i < 4; ++i) {
      bytes_[i] = static_cast<char>(bytes_.size() >> (8 * i) & 255U);
    }
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
};

std::string system_text() { return std::generic_category().message(errno); }

/// Returns HOST and PORT; both empty if the text has another form.
std::pair<std::string, std::string> parts_of(const std::string& address) {
  const auto colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == address.size()) {
    return {};
  }
  std::string host = address.substr(0, colon);
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  }
  return {host, address.substr(colon + 1)};
}

}  // namespace

std::string tev_create_image(std::string_view name, int width, int height,
                             std::span<const std::string_view> channels) {
  Packet packet(kCreateImage);
  packet.add_bool(true);
  packet.add_text(name);
  packet.add_i32(width);
  packet.add_i32(height);
  packet.add_channels(channels);
  return std::move(packet).finished();
}

std::string tev_update_image(std::string_view name, const TevRect& rect,
                             std::span<const std::string_view> channels,
                             std::span<const float> values) {
  Packet packet(kUpdateImage);
  packet.add_bool(false);
  packet.add_text(name);
  packet.add_channels(channels);
  for (const int number : {rect.x, rect.y, rect.width, rect.height}) {
    packet.add_i32(number);
  }
  const std::int64_t count = std::int64_t{rect.width} * rect.height;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    packet.add_int(static_cast<std::int64_t>(c) * count, 8);
  }
  for (std::size_t c = 0; c < channels.size(); ++c) {
    packet.add_int(1, 8);
  }
  for (const float value : values) {
    packet.add_int(std::bit_cast<std::int32_t>(value), 4);
  }
  return std::move(packet).finished();
}

bool is_tev_address(const std::string& address) { return !parts_of(address).first.empty(); }

core::Result<TevConnection> TevConnection::open(const std::string& address) {
  const auto [host, port] = parts_of(address);
  if (host.empty()) {
    return Error{ErrorCode::kInvalidArgument, "\"" + address + "\" is not HOST:PORT", "--tev"};
  }
  const Error nobody{ErrorCode::kUnavailable,
                     "cannot reach tev at " + address +
                         ". Start it first, or give another address with --tev HOST:PORT",
                     ""};
  addrinfo hints = {};
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), port.c_str(), &hints, &found) != 0) {
    return nobody;
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> places(found, &freeaddrinfo);
  for (const addrinfo* place = found; place != nullptr; place = place->ai_next) {
    const int opened =
        socket(place->ai_family, place->ai_socktype | SOCK_CLOEXEC, place->ai_protocol);
    if (opened < 0) {
      continue;
    }
    TevConnection connection(opened);
    const timeval patience = {kPatienceSeconds, 0};  // of connect(), too
    const int yes = 1;
    setsockopt(opened, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
    setsockopt(opened, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    if (connect(opened, place->ai_addr, place->ai_addrlen) == 0) {
      return connection;
    }
  }
  return nobody;
}

TevConnection::~TevConnection() {
  if (socket_ >= 0) {
    close(socket_);
  }
}

TevConnection::TevConnection(TevConnection&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)) {}

TevConnection& TevConnection::operator=(TevConnection&& other) noexcept {
  std::swap(socket_, other.socket_);
  return *this;
}

core::Status TevConnection::send(std::string_view packet) {
  while (!packet.empty()) {
    const ssize_t sent = ::send(socket_, packet.data(), packet.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) {
      continue;
    }
    if (sent < 0) {
      const bool stuck = errno == EAGAIN;  // SO_SNDTIMEO
      return Error{ErrorCode::kUnavailable,
                   stuck ? std::string("tev accepts no more tiles")
                         : "tev has closed the connection (" + system_text() + ")",
                   ""};
    }
    packet.remove_prefix(static_cast<std::size_t>(sent));
  }
  return core::ok_status();
}

}  // namespace cli
