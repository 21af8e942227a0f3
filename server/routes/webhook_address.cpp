#include "server/routes/webhook_address.h"

#include "server/http/web_post.h"

namespace server {

std::optional<std::string> webhook_address_fault(const Config& config, const std::string& url) {
  const auto target = parse_web_target(url);
  if (!target) {
    return "\"" + url + "\" is not an http or https address";
  }
  if (config.webhook_private || !is_private_literal(target->host)) {
    return std::nullopt;
  }
  return target->host +
         " is a private address; start the server with --webhook-private to allow it";
}

}  // namespace server
