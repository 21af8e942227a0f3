/// ApiClient: requests to one server. The only part of the client that uses the HTTP library.
///
/// Errors are sentences: the address that could not be reached and what to do about it, or the
/// server's message (problem+json) with the location of each fault.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace cli {

struct Reply {
  int status = 0;
  std::string body;
  std::string location;
  std::string content_type;
  std::string challenge;  ///< WWW-Authenticate
  std::string exposure;   ///< X-Tessera-Exposure
};

/// Checks that the text is an http or https address with a host.
core::Status check_address(const std::string& url);

/// Converts a problem document, or any other body of an error response, to an Error.
core::Error error_of_reply(const Reply& reply);

class ApiClient {
 public:
  enum class Certificates : std::uint8_t { kChecked, kAnyTaken };
  /// url: http://HOST[:PORT][/PREFIX] or https. key: empty or a bearer token.
  static core::Result<std::unique_ptr<ApiClient>> connect(
      std::string url, const std::string& key, Certificates certificates = Certificates::kChecked);
  ~ApiClient();
  ApiClient(const ApiClient&) = delete;
  ApiClient& operator=(const ApiClient&) = delete;

  using Headers = std::multimap<std::string, std::string>;

  /// The latest response of get(), post(), put(), patch() or remove().
  struct Last {
    int status = 0;                         ///< 0: none came
    int retry_after_seconds = 0;            ///< Retry-After
    std::vector<std::string> missing = {};  ///< of 424: names of the files that a scene lacks
  };
  const Last& last() const noexcept;

  /// Sends a request. 2xx is success; every other status is an Error. path starts with '/'.
  /// Errors: kUnavailable if a retry may help: no response, or 408, 429, 500, 502, 503, 504, 507.
  core::Result<Reply> get(const std::string& path, const Headers& headers = {});
  core::Result<Reply> post(const std::string& path, std::string_view body,
                           const std::string& content_type, const Headers& headers = {});
  core::Result<Reply> put(const std::string& path, std::string_view body,
                          const std::string& content_type);
  core::Result<Reply> patch(const std::string& path, std::string_view body,
                            const std::string& content_type);
  core::Result<Reply> remove(const std::string& path);
  /// Returns the status of a HEAD request, also if it is an error.
  core::Result<int> head(const std::string& path);

  /// Passes on the body of a 200 as it arrives, until it ends or `on_data` returns false (also
  /// success). Status 204 is success without data. silence_max: longest wait for the next byte.
  /// Errors: kUnavailable when the connection failed or was interrupted, so that a retry may help.
  core::Result<int> stream(const std::string& path, const Headers& headers,
                           std::chrono::seconds silence_max,
                           const std::function<bool(std::string_view)>& on_data);

  /// Aborts the current request from another thread; it fails with kUnavailable.
  void stop();

  const std::string& url() const noexcept { return url_; }

 private:
  struct Impl;
  ApiClient(std::string url, std::unique_ptr<Impl> impl);
  std::string url_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cli
