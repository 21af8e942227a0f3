#include "clients/cli/api_client.h"

#include <charconv>
#include <cstdlib>
#include <utility>

#include <httplib.h>
#include <nlohmann/json.hpp>

#include "api/json/error_codes.h"
#include "clients/cli/proxy.h"
#include "core/base/shown_address.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

struct Address {
  std::string origin;
  std::string prefix;
  std::string scheme;
  std::string host;
  int port = 0;
};

/// Returns the host and port of an origin.
void read_host(Address& address) {
  std::string_view host = std::string_view(address.origin).substr(address.scheme.size() + 3);
  address.port = address.scheme == "https" ? 443 : 80;
  const auto colon = host.rfind(':');
  const auto bracket = host.rfind(']');
  if (colon != std::string_view::npos && (bracket == std::string_view::npos || colon > bracket)) {
    const std::string_view digits = host.substr(colon + 1);
    std::from_chars(digits.data(), digits.data() + digits.size(), address.port);
    host = host.substr(0, colon);
  }
  address.host = host;
}

core::Result<Address> parse_address(const std::string& url) {
  const auto scheme = url.find("://");
  const std::string kind = url.substr(0, scheme == std::string::npos ? 0 : scheme);
  if (kind != "http" && kind != "https") {
    return Error{ErrorCode::kInvalidArgument,
                 "\"" + core::shown_address(url) +
                     "\" is not a server address such as http://127.0.0.1:8080",
                 ""};
  }
  const auto path = url.find('/', scheme + 3);
  Address address{.origin = url.substr(0, path),
                  .prefix = path == std::string::npos ? "" : url.substr(path),
                  .scheme = kind,
                  .host = {}};
  if (address.origin.find('@') != std::string::npos) {  // The text does not repeat the password.
    return Error{ErrorCode::kInvalidArgument,
                 "an address with a user name or a password is not supported; give the server's "
                 "key with --key or in TESSERA_KEY",
                 ""};
  }
  while (!address.prefix.empty() && address.prefix.back() == '/') {
    address.prefix.pop_back();
  }
  if (address.origin.size() <= scheme + 3) {
    return Error{ErrorCode::kInvalidArgument,
                 "\"" + core::shown_address(url) + "\" contains no host", ""};
  }
  read_host(address);
  return address;
}

httplib::Headers to_httplib(const ApiClient::Headers& headers) {
  httplib::Headers out;
  for (const auto& [name, value] : headers) {
    out.emplace(name, value);
  }
  return out;
}

Reply to_reply(const httplib::Response& response) {
  return {response.status,
          response.body,
          response.get_header_value("Location"),
          response.get_header_value("Content-Type"),
          response.get_header_value("WWW-Authenticate"),
          response.get_header_value("X-Tessera-Exposure")};
}

std::string member(const nlohmann::json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

ErrorCode code_of_status(int status) {
  switch (status) {
    case 401:
      return api::kUnauthorized;
    case 404:
      return ErrorCode::kNotFound;
    case 409:
      return ErrorCode::kConflict;
    case 408:
    case 429:
    case 500:
    case 502:
    case 503:
    case 504:
    case 507:
      return ErrorCode::kUnavailable;
    default:
      return ErrorCode::kInvalidArgument;
  }
}

}  // namespace

core::Status check_address(const std::string& url) {
  const auto address = parse_address(url);
  return address ? core::ok_status() : core::Status(address.error());
}

core::Error error_of_reply(const Reply& reply) {
  std::string text = "the server answered " + std::to_string(reply.status);
  const auto json = nlohmann::json::parse(reply.body, nullptr, false);
  if (reply.status >= 300 && reply.status < 400) {
    text += reply.location.empty()
                ? ""
                : ": it is at " + core::shown_address(reply.location) + "; give that address";
  } else if (!json.is_object()) {
    text =
        "a proxy before the server, or another program, answered " + std::to_string(reply.status);
    text += reply.status == 413 ? "; its limit for the size of requests must be raised" : "";
  }
  if (json.is_object()) {
    const std::string title = member(json, "title");
    const std::string detail = member(json, "detail");
    text += title.empty() ? "" : " (" + title + ")";
    text += detail.empty() ? "" : ": " + detail;
    if (const auto faults = json.find("errors"); faults != json.end() && faults->is_array()) {
      for (const auto& fault : *faults) {
        const std::string line =
            fault.is_object() ? member(fault, "pointer") + ": " + member(fault, "detail") : "";
        if (text.find(line) == std::string::npos) {  // the detail may repeat the only fault
          text += "\n  " + line;
        }
      }
    }
  }
  if (reply.status == 401) {
    const bool wrong = reply.challenge.find("error=\"invalid_token\"") != std::string::npos;
    text += wrong ? "\n  The key of --key or TESSERA_KEY is not one of this server's keys, which "
                    "`tessera keys list` lists on the server's machine."
                  : "\n  Give the key with --key or in TESSERA_KEY.";
  }
  return Error{code_of_status(reply.status), std::move(text), ""};
}

namespace {

constexpr int kConnectSeconds = 5;

Error blocked(const std::string& url, const ProxyAddress& proxy, const std::string& reason) {
  return Error{ErrorCode::kUnavailable,
               "cannot reach a server at " + core::shown_address(url) +
                   " through the proxy http://" + proxy.host + ":" + std::to_string(proxy.port) +
                   " of " + proxy.variable + ": " + reason +
                   ". NO_PROXY lists hosts that need no proxy.",
               ""};
}

/// Asks a proxy to connect to a server, as httplib does before TLS; but httplib 0.11 goes on after
/// a refusal, and waits for itself forever when the answer ends the connection.
core::Status check_proxy(const std::string& url, const Address& address,
                         const ProxyAddress& proxy) {
  httplib::Client http(proxy.host, proxy.port);
  http.set_connection_timeout(kConnectSeconds);
  http.set_read_timeout(kConnectSeconds);
  httplib::Request connect;
  connect.method = "CONNECT";
  connect.path = address.host + ":" + std::to_string(address.port);
  if (!proxy.user.empty()) {
    connect.headers.insert(
        httplib::make_basic_authentication_header(proxy.user, proxy.password, /*is_proxy=*/true));
  }
  const auto answer = http.send(connect);
  if (!answer) {
    return blocked(url, proxy, httplib::to_string(answer.error()));
  }
  if (answer->status != 200) {
    return blocked(url, proxy, "the proxy answers " + std::to_string(answer->status));
  }
  const bool is_end = answer->get_header_value("Connection") == "close" ||
                      (answer->version == "HTTP/1.0" && answer->reason != "Connection established");
  return is_end ? core::Status(blocked(url, proxy, "the proxy's answer ends the connection"))
                : core::ok_status();
}

}  // namespace

struct ApiClient::Impl {
  Impl(const Address& address, const std::string& key)
      : http(address.origin), prefix(address.prefix) {
    http.set_connection_timeout(kConnectSeconds);
    http.set_read_timeout(90);  // above the longest allowed wait
    http.set_write_timeout(60);
    http.set_keep_alive(true);
    http.set_tcp_nodelay(true);
    if (!key.empty()) {
      http.set_default_headers({{"Authorization", "Bearer " + key}});
    }
  }
  httplib::Client http;
  std::string prefix;
  std::optional<ProxyAddress> proxy;
  Last last;
};

ApiClient::ApiClient(std::string url, std::unique_ptr<Impl> impl)
    : url_(std::move(url)), impl_(std::move(impl)) {}
ApiClient::~ApiClient() = default;

core::Result<std::unique_ptr<ApiClient>> ApiClient::connect(std::string url, const std::string& key,
                                                            Certificates certificates) {
  auto address = parse_address(url);
  if (!address) {
    return address.error();
  }
  auto impl = std::make_unique<Impl>(*address, key);
  if (!impl->http.is_valid()) {
    return Error{ErrorCode::kInvalidArgument,
                 "\"" + core::shown_address(url) + "\" is not a server address", ""};
  }
  auto proxy = proxy_for(address->scheme, address->host, address->port, [](const char* name) {
    const char* value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): never set here.
    return std::string(value == nullptr ? "" : value);
  });
  if (!proxy) {
    return proxy.error();
  }
  if (*proxy) {
    impl->http.set_proxy((*proxy)->host, (*proxy)->port);
    if (!(*proxy)->user.empty()) {
      impl->http.set_proxy_basic_auth((*proxy)->user, (*proxy)->password);
    }
    if (address->scheme == "https") {
      if (const auto willing = check_proxy(url, *address, **proxy); !willing) {
        return willing.error();
      }
    }
    impl->proxy = **proxy;
  }
  impl->http.enable_server_certificate_verification(certificates == Certificates::kChecked);
  return std::unique_ptr<ApiClient>(new ApiClient(std::move(url), std::move(impl)));
}

namespace {

Error unreachable(const std::string& url, httplib::Error error,
                  const std::optional<ProxyAddress>& proxy) {
  if (error == httplib::Error::Write) {
    return Error{ErrorCode::kUnavailable,
                 "the server at " + core::shown_address(url) +
                     " closed the connection while data was sent to it; the file may be larger "
                     "than it accepts (\"limits\" of GET /v1/server)",
                 ""};
  }
  if (proxy) {
    return blocked(url, *proxy, httplib::to_string(error));
  }
  return Error{ErrorCode::kUnavailable,
               "cannot reach a server at " + core::shown_address(url) + " (" +
                   httplib::to_string(error) +
                   "). Start one with `tessera serve`, or give another address with --server or "
                   "TESSERA_SERVER.",
               ""};
}

constexpr std::string_view kFiles = "/files/";

/// A part of a JSON pointer: RFC 6901, 4.
std::string unescaped(std::string_view part) {
  std::string text;
  for (std::size_t i = 0; i < part.size(); ++i) {
    const bool is_escape = part[i] == '~' && i + 1 < part.size();
    text += is_escape ? (part[++i] == '1' ? '/' : '~') : part[i];
  }
  return text;
}

/// Returns the files that a scene lacks: pointers into `files` of a request with asset ids.
std::vector<std::string> missing_in(const Reply& reply) {
  std::vector<std::string> names;
  const auto problem = nlohmann::json::parse(reply.body, nullptr, false);
  if (reply.status != 424 || !problem.is_object()) {
    return names;
  }
  if (const auto list = problem.find("errors"); list != problem.end() && list->is_array()) {
    for (const auto& fault : *list) {
      const std::string pointer = fault.is_object() ? member(fault, "pointer") : "";
      if (pointer.starts_with(kFiles)) {
        names.push_back(unescaped(pointer.substr(kFiles.size())));
      }
    }
  }
  return names;
}

core::Result<Reply> finish(const std::string& url, const std::optional<ProxyAddress>& proxy,
                           const httplib::Result& result, ApiClient::Last& last) {
  last = {};
  if (result) {
    last.status = result->status;
    // A date, which is also allowed, counts as 0.
    const std::string pause = result->get_header_value("Retry-After");
    std::from_chars(pause.data(), pause.data() + pause.size(), last.retry_after_seconds);
  }
  if (!result) {
    return unreachable(url, result.error(), proxy);
  }
  Reply reply = to_reply(*result);
  if (reply.status == 407 && proxy) {
    return blocked(url, *proxy, "the proxy answers 407");
  }
  if (reply.status < 200 || reply.status > 299) {
    last.missing = missing_in(reply);
    return error_of_reply(reply);
  }
  return reply;
}

}  // namespace

core::Result<Reply> ApiClient::get(const std::string& path, const Headers& headers) {
  return finish(url_, impl_->proxy, impl_->http.Get(impl_->prefix + path, to_httplib(headers)),
                impl_->last);
}

core::Result<Reply> ApiClient::post(const std::string& path, std::string_view body,
                                    const std::string& content_type, const Headers& headers) {
  return finish(url_, impl_->proxy,
                impl_->http.Post(impl_->prefix + path, to_httplib(headers), body.data(),
                                 body.size(), content_type),
                impl_->last);
}

core::Result<Reply> ApiClient::put(const std::string& path, std::string_view body,
                                   const std::string& content_type) {
  return finish(url_, impl_->proxy,
                impl_->http.Put(impl_->prefix + path, body.data(), body.size(), content_type),
                impl_->last);
}

core::Result<Reply> ApiClient::patch(const std::string& path, std::string_view body,
                                     const std::string& content_type) {
  return finish(url_, impl_->proxy,
                impl_->http.Patch(impl_->prefix + path, body.data(), body.size(), content_type),
                impl_->last);
}

core::Result<Reply> ApiClient::remove(const std::string& path) {
  return finish(url_, impl_->proxy, impl_->http.Delete(impl_->prefix + path), impl_->last);
}

core::Result<int> ApiClient::head(const std::string& path) {
  const auto result = impl_->http.Head(impl_->prefix + path);
  if (!result) {
    return unreachable(url_, result.error(), impl_->proxy);
  }
  return int{result->status};
}

core::Result<int> ApiClient::stream(const std::string& path, const Headers& headers,
                                    std::chrono::seconds silence_max,
                                    const std::function<bool(std::string_view)>& on_data) {
  Reply failure;
  bool enough = false;
  impl_->http.set_read_timeout(silence_max);
  const auto result = impl_->http.Get(
      impl_->prefix + path, to_httplib(headers),
      [&failure](const httplib::Response& response) {
        failure = to_reply(response);
        return true;
      },
      [&](const char* data, std::size_t size) {
        if (failure.status != 200) {
          failure.body.append(data, size);
          return true;
        }
        enough = !on_data({data, size});
        return !enough;
      });
  impl_->http.set_read_timeout(90);
  if (enough) {
    return 200;
  }
  if (!result) {
    return unreachable(url_, result.error(), impl_->proxy);
  }
  if (failure.status != 200 && failure.status != 204) {
    return error_of_reply(failure);
  }
  return int{failure.status};
}

const ApiClient::Last& ApiClient::last() const noexcept { return impl_->last; }

void ApiClient::stop() { impl_->http.stop(); }

}  // namespace cli
