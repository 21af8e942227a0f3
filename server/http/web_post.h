/// POSTs to user-supplied addresses, for webhooks. The only code that uses libcurl.
///
/// The address is checked when the socket connects, so that a name cannot resolve to another one in
/// between (DNS rebinding). That cannot be checked behind a proxy: those of the environment are
/// used only by calls that may reach any address. Redirects are not followed; only the status of
/// the response is read.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/result.h"

namespace server {

struct WebTarget {
  bool is_tls = false;
  std::string host;  ///< A name or an address, IPv6 without brackets.
  int port = 80;
  std::string path = "/";  ///< Including its query.
};
/// Returns empty unless it is http(s)://host[:port][/path][?query].
std::optional<WebTarget> parse_web_target(std::string_view url);

/// True for localhost, or an address (not a name) that is not on the public internet.
bool is_private_literal(std::string_view host);
/// True for a public IPv4 or IPv6 address in numeric form; false for other texts.
bool is_public_address(std::string_view address);

enum class Reach { kPublicOnly, kAnywhere };

struct WebPost {
  std::string url;  ///< Must be accepted by parse_web_target().
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;  ///< With Content-Type.
  Reach reach = Reach::kPublicOnly;
  std::chrono::milliseconds timeout{15'000};  ///< For the whole call, including name resolution.
};

/// Concurrent POSTs, driven by the thread that calls wait(). tests/simulation has others than those
/// of libcurl.
class WebCaller {
 public:
  WebCaller() = default;
  virtual ~WebCaller() = default;
  WebCaller(const WebCaller&) = delete;
  WebCaller& operator=(const WebCaller&) = delete;

  virtual void begin(std::string id, const WebPost& post) = 0;
  struct Ended {
    std::string id;
    /// Status of the response. Errors: kForbidden for an address that is not public; kUnavailable,
    /// with the reason, when there was no response.
    core::Result<int> status;
  };
  /// Returns when a call has ended, when wake() is called, or after `time`.
  virtual std::vector<Ended> wait(std::chrono::milliseconds time) = 0;
  /// Ends a wait(). From any thread.
  virtual void wake() = 0;
};

class WebCalls final : public WebCaller {
 public:
  WebCalls();
  ~WebCalls() override;

  void begin(std::string id, const WebPost& post) override;
  std::vector<Ended> wait(std::chrono::milliseconds time) override;
  void wake() override;
  std::size_t open_count() const { return calls_.size(); }

 private:
  struct Call;
  struct Free {
    void operator()(void* multi) const;
  };
  std::unique_ptr<void, Free> multi_;
  std::vector<std::unique_ptr<Call>> calls_;
};

}  // namespace server
