// For each look a sealed line of its key, the size and checksum of its content, and the figures of
// its headers, "-" for none; then the content.

#include "server/routes/look_file.h"

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <utility>

#include <fcntl.h>
#include <zlib.h>

#include "server/store/files.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

std::uint64_t crc_of(std::string_view content) {
  return crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size());
}

template <typename Number>
std::string exact(const std::optional<Number>& value) {
  std::array<char, 64> text = {'-'};
  if (value) {
    std::snprintf(text.data(), text.size(), "%a", static_cast<double>(*value));
  }
  return text.data();
}

template <typename Number>
std::optional<Number> number_of(const std::string& text) {
  return text == "-" ? std::nullopt
                     : std::optional(static_cast<Number>(std::strtod(text.c_str(), nullptr)));
}

core::Result<std::string> read_file(const std::string& path) {
  const auto file = open_file(path, O_RDONLY);
  const auto bytes = file ? file_bytes(file->get(), path) : file.error();
  if (!bytes) {
    return bytes.error();
  }
  std::string text(*bytes, '\0');
  const auto got = read_at(file->get(), std::as_writable_bytes(std::span(text)), 0, path);
  if (!got) {
    return got.error();
  }
  text.resize(*got);
  return text;
}

}  // namespace

core::Status write_looks(const std::string& path, const std::vector<StoredLook>& looks) {
  const std::string part = path + ".part";
  auto file = open_file(part, O_WRONLY | O_CREAT | O_TRUNC);
  if (!file) {
    return file.error();
  }
  std::uint64_t at = 0;
  const auto write = [&](std::string_view text) {
    at += text.size();
    return write_at(file->get(), std::as_bytes(std::span(text)), at - text.size(), part);
  };
  core::Status written = core::ok_status();
  for (const auto& [key, picture] : looks) {
    const std::string line = seal(key + " " + std::to_string(picture.content->size()) + " " +
                                  std::to_string(crc_of(*picture.content)) + " " +
                                  exact(picture.set_aside) + " " + exact(picture.exposure_stops));
    written = written ? write(line + "\n") : written;
    written = written ? write(*picture.content) : written;
  }
  written = written ? rename_file(part, path) : written;
  if (!written) {
    static_cast<void>(remove_file(part));
  }
  return written;
}

core::Result<EncodedPicture> read_look(const std::string& path, std::string_view key) {
  const auto text = read_file(path);
  if (!text) {
    return text.error();
  }
  const Error damaged = {ErrorCode::kInternal, "a look file is damaged", path};
  for (std::size_t at = 0; at < text->size();) {
    const std::size_t end = text->find('\n', at);
    const auto words = end == std::string::npos ? std::nullopt : unseal(text->substr(at, end - at));
    if (!words) {
      return damaged;
    }
    std::istringstream line(*words);
    std::string name;
    std::string set_aside;
    std::string exposure;
    std::size_t bytes = 0;
    std::uint64_t crc = 0;
    line >> name >> bytes >> crc >> set_aside >> exposure;
    if (!line || bytes > text->size() - end - 1) {
      return damaged;
    }
    at = end + 1 + bytes;
    if (name != key) {
      continue;
    }
    std::string content = text->substr(end + 1, bytes);
    if (crc_of(content) != crc) {
      return damaged;
    }
    return EncodedPicture{.content = std::make_shared<const std::string>(std::move(content)),
                          .range = {},
                          .set_aside = number_of<double>(set_aside),
                          .exposure_stops = number_of<float>(exposure)};
  }
  return Error{ErrorCode::kNotFound, "no such look", path};
}

}  // namespace server
