// Too many connections: which are served and which are closed.

#include <algorithm>
#include <chrono>
#include <thread>

#include <gtest/gtest.h>

#include "server/http/client_address.h"
#include "server/http/stream_gate.h"
#include "tests/unit/server/http_test_server.h"

namespace server {
namespace {

using http_test::Client;
using http_test::get;
using http_test::TestServer;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::string_view kHalfAHead = "GET /echo/a HTTP/1.1\r\nHo";

/// No timeouts here: only limits close connections.
HttpLimits patient_limits() {
  HttpLimits limits;
  limits.header_deadline = seconds(60);
  limits.keep_alive_idle = seconds(60);
  return limits;
}

std::vector<std::unique_ptr<Client>> connect(const TestServer& server, int count,
                                             std::string_view bytes) {
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < count; ++i) {
    clients.push_back(std::make_unique<Client>(server));
    clients.back()->send(bytes);
  }
  return clients;
}

/// Answers when opened; counts the requests inside.
struct Door {
  core::Mutex mutex;
  core::CondVar changed;
  bool is_open GUARDED_BY(mutex) = false;
  int inside GUARDED_BY(mutex) = 0;

  Handler handler() {
    return [this](Request&) {
      core::MutexLock lock(mutex);
      ++inside;
      changed.notify_all();
      while (!is_open) {
        changed.wait(mutex);
      }
      return text_response(200, "text/plain", "out");
    };
  }
  void wait_for(int count) {
    core::MutexLock lock(mutex);
    while (inside < count) {
      changed.wait(mutex);
    }
  }
  void open() {
    core::MutexLock lock(mutex);
    is_open = true;
    changed.notify_all();
  }
};

TEST(HttpFlood, ClosesTheOldestWaitingConnectionOfOneAddressForANewOne) {
  HttpLimits limits = patient_limits();
  limits.max_waiting_of_address = 4;
  TestServer server({}, limits);
  const auto are_evicted = [&](std::uint64_t count) {
    const auto deadline = std::chrono::steady_clock::now() + seconds(10);
    while (server.http().stats().connections_evicted_of_address < count) {
      if (std::chrono::steady_clock::now() > deadline) {
        return false;
      }
      std::this_thread::sleep_for(milliseconds(1));
    }
    return true;
  };
  // A connection starts to wait when its thread runs, so the order within a group is arbitrary.
  // 16 of 20 are closed only once all have started; the next group is newer.
  const auto old = connect(server, 20, kHalfAHead);
  EXPECT_TRUE(are_evicted(16));
  const auto newer = connect(server, 20, kHalfAHead);
  for (int i = 0; i < 10; ++i) {
    Client client(server);
    EXPECT_EQ(client.exchange(get("/echo/hello")).body, "hello");
  }
  for (const auto& client : old) {
    EXPECT_TRUE(client->is_closed_within(seconds(10)));
  }
  EXPECT_TRUE(are_evicted(36));
  EXPECT_EQ(server.http().stats().connections_refused, 0U);
}

TEST(HttpFlood, TotalLimitAlsoAppliesToKnownClients) {
  HttpLimits limits = patient_limits();
  limits.max_waiting = 4;
  TestServer server({}, limits);
  const auto idle = connect(server, 12, get("/echo/a"));
  for (const auto& client : idle) {
    client->receive();
  }
  // The last of them may not be waiting again yet when its answer is here: a later request counts
  // it.
  const auto deadline = std::chrono::steady_clock::now() + seconds(10);
  do {
    EXPECT_EQ(Client(server).exchange(get("/echo/b")).body, "b");
  } while (server.http().stats().connections_evicted < 8 &&
           std::chrono::steady_clock::now() < deadline);
  EXPECT_GE(server.http().stats().connections_evicted, 8U);
  // Any of them may have begun last to wait again.
  EXPECT_TRUE(std::any_of(idle.begin(), idle.end(),
                          [](const auto& client) { return client->is_closed_within(seconds(1)); }));
}

TEST(HttpFlood, DoesNotRefuseRequestsInProgress) {
  HttpLimits limits = patient_limits();
  limits.max_waiting_of_address = 2;
  Door door;
  TestServer server({{.method = "GET", .pattern = "/door", .handler = door.handler()}}, limits);
  Client inside(server);
  inside.send(get("/door"));
  door.wait_for(1);
  const auto drips = connect(server, 20, kHalfAHead);
  EXPECT_TRUE(drips.front()->is_closed_within(seconds(10)));
  door.open();
  EXPECT_EQ(inside.receive().body, "out");
}

TEST(HttpFlood, ClosesIdleConnectionsWhenFull) {
  HttpLimits limits = patient_limits();
  limits.max_connections = 2;
  TestServer server({}, limits);
  Client first(server);
  Client second(server);
  EXPECT_EQ(first.exchange(get("/echo/a")).status, 200);
  EXPECT_EQ(second.exchange(get("/echo/a")).status, 200);
  EXPECT_EQ(Client(server).exchange(get("/echo/a")).status, 200);
}

TEST(HttpFlood, FullServerRefusesClientsButAnswersProbes) {
  HttpLimits limits = patient_limits();
  limits.max_connections = 2;
  Door door;
  TestServer server({{.method = "GET", .pattern = "/door", .handler = door.handler()}}, limits);
  const auto busy = connect(server, 2, get("/door"));
  door.wait_for(2);
  const auto drips = connect(server, 60, kHalfAHead);
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(Client(server).exchange(get("/livez")).status, 200);
  }
  const http_test::Answer refused = Client(server).exchange(get("/echo/a"));
  EXPECT_EQ(refused.status, 503);
  EXPECT_EQ(refused.header("Retry-After"), "5");
  door.open();
  EXPECT_EQ(busy.front()->receive().status, 200);
}

TEST(HttpFlood, RefusesAConnectionWithoutAThreadAndKeepsOthers) {
  HttpLimits limits = patient_limits();
  limits.max_connections = 1;
  limits.max_waiting = 1;
  Door door;
  TestServer server(
      {{.method = "GET", .pattern = "/door", .handler = door.handler(), .is_probe = true}}, limits);
  const auto clients = connect(server, 60, get("/door"));
  // Threads for one active connection, one that waits, and those reserved for probes.
  door.wait_for(18);
  EXPECT_EQ(clients.back()->receive().status, 503);
  EXPECT_GE(server.http().stats().connections_refused, 42U);
  door.open();
  EXPECT_EQ(clients.front()->receive().status, 200);
  EXPECT_EQ(Client(server).exchange(get("/livez")).status, 200);
}

TEST(HttpFlood, LimitsRequestsOfOneAddressExceptProbes) {
  HttpLimits limits = patient_limits();
  limits.max_requests_of_client = 2;
  Door door;
  TestServer server({{.method = "GET", .pattern = "/door", .handler = door.handler()}}, limits);
  const auto busy = connect(server, 2, get("/door"));
  door.wait_for(2);
  const http_test::Answer refused = Client(server).exchange(get("/echo/a"));
  EXPECT_EQ(refused.status, 429);
  EXPECT_EQ(refused.header("Retry-After"), "5");
  EXPECT_EQ(Client(server).exchange(get("/livez")).status, 200);
  EXPECT_EQ(server.http().stats().requests_refused, 1U);
  door.open();
  EXPECT_EQ(busy.front()->receive().status, 200);
  EXPECT_EQ(busy.back()->receive().status, 200);
  EXPECT_EQ(Client(server).exchange(get("/echo/a")).status, 200);
}

TEST(HttpFlood, DoesNotLimitRequestsOfWorkers) {
  HttpLimits limits = patient_limits();
  limits.max_requests_of_client = 1;
  Door door;
  TestServer server({{.method = "GET", .pattern = "/door", .handler = door.handler()}}, limits);
  const std::string of_worker = "GET /door HTTP/1.1\r\nHost: x\r\nX-Worker: 1\r\n\r\n";
  const auto busy = connect(server, 4, of_worker);
  door.wait_for(4);
  EXPECT_EQ(Client(server).exchange(get("/echo/a")).status, 200);
  door.open();
  for (const auto& client : busy) {
    EXPECT_EQ(client->receive().status, 200);
  }
}

TEST(HttpFlood, StreamDoesNotCountAsARequest) {
  HttpLimits limits = patient_limits();
  limits.max_requests_of_client = 1;
  TestServer server({{.method = "GET",
                      .pattern = "/stream",
                      .handler =
                          [](Request&) {
                            return stream_response("text/plain", [](StreamWriter& writer) {
                              while (writer.write("x") && !writer.stopping()) {
                                std::this_thread::sleep_for(milliseconds(20));
                              }
                            });
                          }}},
                    limits);
  Client stream(server);
  stream.send(get("/stream"));
  EXPECT_TRUE(stream.wait_for("x"));
  EXPECT_EQ(Client(server).exchange(get("/echo/a")).status, 200);
}

Networks networks(const std::vector<std::string>& texts) { return Networks::parse(texts).value(); }

Request forwarded(std::string_view peer, std::string_view for_whom, std::string_view scheme,
                  const Networks& trusted) {
  Request request;
  request.headers.add("X-Forwarded-For", for_whom);
  request.headers.add("X-Forwarded-Proto", scheme);
  note_client(request, peer, /*is_tls=*/false, trusted);
  return request;
}

TEST(HttpClientAddress, IgnoresAForwardedAddressOfAnUntrustedPeer) {
  const Request request = forwarded("192.0.2.1", "198.51.100.7", "https", networks({"10.0.0.0/8"}));
  EXPECT_EQ(request.remote_addr, "192.0.2.1");
  EXPECT_FALSE(request.is_https);
}

TEST(HttpClientAddress, IsTheFirstUntrustedOneFromTheRightBehindTrustedProxies) {
  const Networks trusted = networks({"10.0.0.0/8", "fd00::/8"});
  EXPECT_EQ(forwarded("10.1.1.1", "6.6.6.6, 198.51.100.7, fd00::2", "https", trusted).remote_addr,
            "198.51.100.7");
  EXPECT_EQ(forwarded("fd00::1", "[2001:db8::1]:443", "https", trusted).remote_addr, "2001:db8::1");
  EXPECT_EQ(forwarded("10.1.1.1", "198.51.100.7:5000", "https", trusted).remote_addr,
            "198.51.100.7");
  EXPECT_EQ(forwarded("10.1.1.1", "nonsense", "https", trusted).remote_addr, "10.1.1.1");
}

TEST(HttpClientAddress, SchemeIsThatOfTheNearestProxy) {
  const Networks trusted = networks({"10.0.0.1"});
  EXPECT_TRUE(forwarded("10.0.0.1", "1.2.3.4", "http, HTTPS", trusted).is_https);
  EXPECT_FALSE(forwarded("10.0.0.1", "1.2.3.4", "https, http", trusted).is_https);
  EXPECT_FALSE(forwarded("10.0.0.2", "1.2.3.4", "https", trusted).is_https);
}

Request with_fields(std::string_view peer,
                    const std::vector<std::pair<std::string, std::string>>& fields) {
  Request request;
  for (const auto& [name, value] : fields) {
    request.headers.add(name, value);
  }
  note_client(request, peer, /*is_tls=*/false, networks({"10.0.0.0/8"}));
  return request;
}

TEST(HttpClientAddress, HostIsThatWhichTheClientAskedTheFirstTrustedProxyFor) {
  const auto host_of = [](std::string_view peer, const auto& fields) {
    return with_fields(peer, fields).forwarded_host;
  };
  using Fields = std::vector<std::pair<std::string, std::string>>;
  EXPECT_EQ(host_of("10.0.0.1", Fields{{"X-Forwarded-Host", "a.example:8443"}}), "a.example:8443");
  EXPECT_EQ(
      host_of("10.0.0.1", Fields{{"X-Forwarded-Host", "a.example"}, {"X-Forwarded-Port", "8443"}}),
      "a.example:8443");
  EXPECT_EQ(host_of("10.0.0.1",
                    Fields{{"X-Forwarded-Host", "[2001:db8::1]"}, {"X-Forwarded-Port", "8443"}}),
            "[2001:db8::1]:8443");
  // The client sent evil.example itself; its proxy appended the host that was asked for.
  EXPECT_EQ(host_of("10.0.0.1", Fields{{"X-Forwarded-For", "192.0.2.9, 198.51.100.7"},
                                       {"X-Forwarded-Host", "evil.example, a.example"}}),
            "a.example");
  EXPECT_EQ(host_of("10.0.0.1", Fields{{"X-Forwarded-For", "198.51.100.7, 10.0.0.2"},
                                       {"X-Forwarded-Host", "a.example, inner.example"}}),
            "a.example");
  EXPECT_EQ(host_of("192.0.2.1", Fields{{"X-Forwarded-Host", "a.example"}}), "");
}

TEST(HttpClientAddress, ReadsForwarded) {
  const Request request =
      with_fields("10.0.0.1", {{"Forwarded",
                                "for=192.0.2.9;host=evil.example;proto=http, "
                                "for=\"[2001:db8::7]:443\";proto=HTTPS;host=\"a.example:8443\""}});
  EXPECT_EQ(request.remote_addr, "2001:db8::7");
  EXPECT_TRUE(request.is_https);
  EXPECT_EQ(request.forwarded_host, "a.example:8443");
}

TEST(HttpClientAddress, ChecksAndComparesNetworks) {
  EXPECT_TRUE(networks({"0.0.0.0/0"}).contains("203.0.113.9"));
  EXPECT_FALSE(networks({"0.0.0.0/0"}).contains("2001:db8::1"));
  EXPECT_TRUE(networks({"10.20.0.0/15"}).contains("10.21.255.255"));
  EXPECT_FALSE(networks({"10.20.0.0/15"}).contains("10.22.0.0"));
  EXPECT_TRUE(networks({"192.0.2.1"}).contains("::ffff:192.0.2.1"));
  for (const char* text : {"10.0.0.1/8", "10.0.0.0/33", "fd00::/129", "example.org", "", "/8"}) {
    EXPECT_FALSE(Networks::parse({text})) << text;
  }
}

TEST(HttpClientAddress, GroupsAnIpv6Customer) {
  EXPECT_EQ(address_group("2001:db8:1:2:3:4:5:6"), address_group("2001:db8:1:2::9"));
  EXPECT_NE(address_group("2001:db8:1:2::1"), address_group("2001:db8:1:3::1"));
  EXPECT_NE(address_group("192.0.2.1"), address_group("192.0.2.2"));
}

}  // namespace
}  // namespace server
