// For each image a sealed line of its key, the size and checksum of its content, and the figures of
// its headers, "-" for none; then the content.

#include "server/routes/first_image_file.h"

#include <algorithm>
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

/// More than the line of an image: two hashes, an ETag and five numbers.
constexpr std::size_t kLineMost = 1024;

/// The line of an image, and where its content is.
struct Head {
  std::string key;
  std::uint64_t at = 0;
  std::uint64_t bytes = 0;
  std::uint64_t crc = 0;
  std::string set_aside;
  std::string exposure;
};

class FirstImageFile {
 public:
  static core::Result<FirstImageFile> open(const std::string& path) {
    auto file = open_file(path, O_RDONLY);
    const auto bytes = file ? file_bytes(file->get(), path) : file.error();
    if (!bytes) {
      return bytes.error();
    }
    return FirstImageFile(path, *std::move(file), *bytes);
  }

  bool has_more() const { return next_ < bytes_; }
  core::Result<Head> next() {
    auto line = read(next_, std::min<std::uint64_t>(kLineMost, bytes_ - next_));
    if (!line) {
      return line.error();
    }
    const std::size_t end = line->find('\n');
    const auto words = end == std::string::npos ? std::nullopt : unseal(line->substr(0, end));
    if (!words) {
      return damaged();
    }
    Head head;
    std::istringstream in(*words);
    in >> head.key >> head.bytes >> head.crc >> head.set_aside >> head.exposure;
    head.at = next_ + end + 1;
    if (!in || head.bytes > bytes_ - head.at) {
      return damaged();
    }
    next_ = head.at + head.bytes;
    return head;
  }
  core::Result<std::string> content(const Head& head) const {
    auto content = read(head.at, head.bytes);
    return content && crc_of(*content) != head.crc ? damaged() : content;
  }

 private:
  FirstImageFile(std::string path, UniqueFd file, std::uint64_t bytes)
      : path_(std::move(path)), file_(std::move(file)), bytes_(bytes) {}
  Error damaged() const { return {ErrorCode::kInternal, "a look file is damaged", path_}; }
  core::Result<std::string> read(std::uint64_t at, std::uint64_t bytes) const {
    std::string text(bytes, '\0');
    const auto got = read_at(file_.get(), std::as_writable_bytes(std::span(text)), at, path_);
    if (!got) {
      return got.error();
    }
    return *got == bytes ? core::Result<std::string>(std::move(text)) : damaged();
  }

  std::string path_;
  UniqueFd file_;
  std::uint64_t bytes_;
  std::uint64_t next_ = 0;
};

}  // namespace

std::string first_images_text(const std::vector<FirstImage>& images) {
  std::string text;
  for (const auto& [key, picture] : images) {
    text += seal(key + " " + std::to_string(picture.content->size()) + " " +
                 std::to_string(crc_of(*picture.content)) + " " + exact(picture.set_aside) + " " +
                 exact(picture.exposure_stops)) +
            "\n" + *picture.content;
  }
  return text;
}

core::Status write_first_images(const std::string& path, std::string_view text) {
  const std::string part = path + std::string(kPartEnd);
  auto file = open_file(part, O_WRONLY | O_CREAT | O_TRUNC);
  if (!file) {
    return file.error();
  }
  core::Status written = write_at(file->get(), std::as_bytes(std::span(text)), 0, part);
  written = written ? rename_file(part, path) : written;
  if (!written) {
    static_cast<void>(remove_file(part));
  }
  return written;
}

core::Result<EncodedPicture> read_first_image(const std::string& path, std::string_view key) {
  auto file = FirstImageFile::open(path);
  if (!file) {
    return file.error();
  }
  while (file->has_more()) {
    const auto head = file->next();
    if (!head) {
      return head.error();
    }
    if (head->key != key) {
      continue;
    }
    auto content = file->content(*head);
    if (!content) {
      return content.error();
    }
    return EncodedPicture{.content = std::make_shared<const std::string>(*std::move(content)),
                          .range = {},
                          .set_aside = number_of<double>(head->set_aside),
                          .exposure_stops = number_of<float>(head->exposure)};
  }
  return Error{ErrorCode::kNotFound, "no such image", path};
}

core::Status check_first_images(const std::string& path) {
  auto file = FirstImageFile::open(path);
  if (!file) {
    return file.error();
  }
  while (file->has_more()) {
    const auto head = file->next();
    if (!head) {
      return head.error();
    }
    if (const auto content = file->content(*head); !content) {
      return content.error();
    }
  }
  return core::ok_status();
}

}  // namespace server
