#include "server/config_text.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <system_error>

#include <fcntl.h>

#include "server/http/text.h"
#include "server/store/files.h"

namespace server {

using core::Error;
using core::ErrorCode;

namespace {

/// Settings files have some lines; a larger one is another file.
constexpr std::size_t kFileBytesMax = std::size_t{1} << 20U;
constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";

std::string in_lower_case(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  const std::size_t begin = text.find_first_not_of(kBlanks);
  return begin == std::string_view::npos
             ? std::string_view()
             : text.substr(begin, text.find_last_not_of(kBlanks) + 1 - begin);
}

Error unusable(std::string_view text, const std::string& why) {
  return Error{ErrorCode::kInvalidArgument, "\"" + std::string(text) + "\" " + why, ""};
}

bool is_host_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '.' || c == '-' || c == '_';
}

/// Returns whether it is a name, an IPv4 address, or an IPv6 address in brackets, and then perhaps
/// a port.
bool is_host_and_port(std::string_view text) {
  std::size_t end = 0;
  if (text.starts_with('[')) {
    end = text.find(']');
    if (end == std::string_view::npos ||
        !std::all_of(text.begin() + 1, text.begin() + static_cast<std::ptrdiff_t>(end), [](char c) {
          return std::isxdigit(static_cast<unsigned char>(c)) != 0 || c == ':' || c == '.';
        })) {
      return false;
    }
    ++end;
  } else {
    end = std::min(text.find(':'), text.size());
    if (end == 0 || !std::all_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end),
                                 &is_host_character)) {
      return false;
    }
  }
  const std::string_view rest = text.substr(end);
  const auto port = rest.empty()
                        ? std::optional<std::uint64_t>(1)
                        : parse_decimal(rest.substr(std::min<std::size_t>(1, rest.size())));
  return rest.empty() || (rest.front() == ':' && port && *port >= 1 && *port <= 65535);
}

}  // namespace

std::vector<std::string> split_commas(std::string_view text) {
  std::vector<std::string> parts;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(','), text.size());
    if (const std::string_view part = trimmed(text.substr(0, end)); !part.empty()) {
      parts.emplace_back(part);
    }
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return parts;
}

core::Result<std::string> read_settings_file(const std::string& path) {
  const auto cannot = [&path](std::string why) {
    return Error{ErrorCode::kInvalidArgument, std::move(why), path};
  };
  std::error_code code;
  if (std::filesystem::is_directory(path, code)) {
    return cannot("is a directory, not a file");
  }
  const auto fd = open_file(path, O_RDONLY);
  if (!fd) {
    return cannot("cannot be read: " + fd.error().message);
  }
  std::string text(kFileBytesMax + 1, '\0');
  const auto got = read_at(fd->get(), std::as_writable_bytes(std::span(text)), 0, path);
  if (!got || *got > kFileBytesMax) {
    return cannot(got ? "has more than a megabyte" : "cannot be read: " + got.error().message);
  }
  text.resize(*got);
  if (text.starts_with(kByteOrderMark)) {
    text.erase(0, kByteOrderMark.size());
  }
  return text;
}

core::Result<std::string> normal_host(std::string_view text) {
  if (text.find("://") != std::string_view::npos) {
    return unusable(text, "has a scheme; expected a host name, such as render.example.org");
  }
  if (text.find('*') != std::string_view::npos) {
    return unusable(text, "has a wildcard; name each host");
  }
  if (!is_host_and_port(text)) {
    return unusable(text, "is not a host name or address");
  }
  return in_lower_case(text);
}

core::Result<std::string> normal_origin(std::string_view text) {
  const std::size_t colon = text.find("://");
  if (colon == std::string_view::npos || colon == 0) {
    return unusable(text, "has no scheme; expected an origin, such as https://shop.example.org");
  }
  const std::string scheme = in_lower_case(text.substr(0, colon));
  std::string_view host = text.substr(colon + 3);
  if (host.ends_with('/')) {
    host.remove_suffix(1);
  }
  if (host.find('*') != std::string_view::npos) {
    return unusable(text, "has a wildcard; name each origin");
  }
  const bool is_scheme = std::all_of(scheme.begin(), scheme.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '+' || c == '-' || c == '.';
  });
  if (!is_scheme || !is_host_and_port(host)) {
    return unusable(text, "is not an origin: expected scheme, host and perhaps port, and no path");
  }
  std::string origin = scheme + "://" + in_lower_case(host);
  const std::string port = scheme == "https" ? ":443" : scheme == "http" ? ":80" : "";
  if (!port.empty() && origin.ends_with(port)) {
    origin.resize(origin.size() - port.size());
  }
  return origin;
}

}  // namespace server
