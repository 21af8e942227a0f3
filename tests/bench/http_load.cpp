// Requests per second and their latencies over keep-alive connections, from one thread.
//   http_load PORT PATH CONNECTIONS SECONDS
// Prints: requests, requests per second, p50, p99 and maximum latency in milliseconds. Exit code 1:
// an answer was not 200.
#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace {

using Clock = std::chrono::steady_clock;

struct Connection {
  int fd = -1;
  std::string answer;
  std::size_t length = 0;  ///< of the whole answer; 0: its head is incomplete
  Clock::time_point asked;
};

int connect_to(int port) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int on = 1;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  if (fd < 0 || connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    std::perror("connect");
    std::exit(1);
  }
  return fd;
}

void ask(Connection& c, const std::string& request) {
  c.answer.clear();
  c.length = 0;
  c.asked = Clock::now();
  if (write(c.fd, request.data(), request.size()) != static_cast<ssize_t>(request.size())) {
    std::perror("write");
    std::exit(1);
  }
}

/// Reads the available bytes; returns true if the answer is complete.
bool take(Connection& c) {
  std::array<char, 65536> buffer;
  const ssize_t got = read(c.fd, buffer.data(), buffer.size());
  if (got <= 0) {
    std::fprintf(stderr, "the connection was closed\n");
    std::exit(1);
  }
  c.answer.append(buffer.data(), static_cast<std::size_t>(got));
  if (c.length == 0) {
    const std::size_t end = c.answer.find("\r\n\r\n");
    if (end == std::string::npos) {
      return false;
    }
    if (!c.answer.starts_with("HTTP/1.1 200 ")) {
      std::fprintf(stderr, "%s\n", c.answer.c_str());
      std::exit(1);
    }
    constexpr std::string_view kName = "\r\nContent-Length: ";
    const std::size_t at = c.answer.find(kName);
    if (at == std::string::npos || at > end) {
      std::fprintf(stderr, "no Content-Length\n");
      std::exit(1);
    }
    c.length = end + 4 + std::strtoul(c.answer.c_str() + at + kName.size(), nullptr, 10);
  }
  return c.answer.size() >= c.length;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: http_load PORT PATH CONNECTIONS SECONDS\n");
    return 2;
  }
  const int port = std::atoi(argv[1]);
  const std::string request =
      "GET " + std::string(argv[2]) + " HTTP/1.1\r\nHost: 127.0.0.1:" + argv[1] + "\r\n\r\n";
  std::vector<Connection> connections(static_cast<std::size_t>(std::atoi(argv[3])));
  const double seconds = std::atof(argv[4]);
  const int poll = epoll_create1(0);
  for (std::size_t i = 0; i < connections.size(); ++i) {
    connections[i].fd = connect_to(port);
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u64 = i;
    epoll_ctl(poll, EPOLL_CTL_ADD, connections[i].fd, &event);
    ask(connections[i], request);
  }
  std::vector<float> delays;
  delays.reserve(1'000'000);
  const auto start = Clock::now();
  const auto since = [](Clock::time_point t) {
    return std::chrono::duration<double>(Clock::now() - t).count();
  };
  std::array<epoll_event, 256> events;
  while (since(start) < seconds) {
    const int count = epoll_wait(poll, events.data(), static_cast<int>(events.size()), 100);
    for (int i = 0; i < count; ++i) {
      Connection& c = connections[events[static_cast<std::size_t>(i)].data.u64];
      if (take(c)) {
        delays.push_back(static_cast<float>(since(c.asked) * 1e3));
        ask(c, request);
      }
    }
  }
  const double length = since(start);
  if (delays.empty()) {
    std::fprintf(stderr, "no answer\n");
    return 1;
  }
  std::sort(delays.begin(), delays.end());
  std::printf(
      "%zu %.0f %.3f %.3f %.3f\n", delays.size(), static_cast<double>(delays.size()) / length,
      static_cast<double>(delays[delays.size() / 2]),
      static_cast<double>(delays[delays.size() * 99 / 100]), static_cast<double>(delays.back()));
  return 0;
}
