#include "server/http/security_headers.h"

namespace server {

std::string page_policy(std::string_view ancestors) {
  return "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
         "font-src 'self'; connect-src 'self'; worker-src 'self'; manifest-src 'self'; "
         "base-uri 'none'; form-action 'self'; frame-ancestors " +
         std::string(ancestors);
}

void add_security_headers(Response& response, bool tls_only) {
  Headers& headers = response.headers;
  headers.set("X-Content-Type-Options", "nosniff");
  headers.set("Referrer-Policy", "no-referrer");
  if (!headers.contains("Content-Security-Policy")) {
    // Browsers display an image opened directly with their own inline style.
    headers.set("Content-Security-Policy",
                "default-src 'none'; style-src 'unsafe-inline'; img-src 'self'; "
                "frame-ancestors 'none'");
  }
  if (tls_only) {
    headers.set("Strict-Transport-Security", "max-age=31536000");
  }
}

}  // namespace server
