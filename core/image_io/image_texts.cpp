#include "core/image_io/image_texts.h"

#include <optional>
#include <span>
#include <string_view>

#include "core/base/byte_order.h"

namespace core {
namespace {

using Texts = std::map<std::string, std::string>;

constexpr std::string_view kPngMagic = "\x89PNG\r\n\x1a\n";
constexpr std::string_view kExrMagic = "\x76\x2f\x31\x01";

Error cut() {
  return Error{ErrorCode::kInvalidArgument, "the image's header is truncated or too long", ""};
}

/// Takes bytes from the front; empty if there are too few.
class Front {
 public:
  explicit Front(std::string_view rest) : rest_(rest) {}
  std::optional<std::string_view> take(std::size_t bytes) {
    if (bytes > rest_.size()) {
      return std::nullopt;
    }
    const std::string_view piece = rest_.substr(0, bytes);
    rest_.remove_prefix(bytes);
    return piece;
  }
  /// Takes text up to and including a zero byte.
  std::optional<std::string_view> take_word() {
    const std::size_t end = rest_.find('\0');
    if (end == std::string_view::npos) {
      return std::nullopt;
    }
    const std::string_view word = rest_.substr(0, end);
    rest_.remove_prefix(end + 1);
    return word;
  }

 private:
  std::string_view rest_;
};

Result<Texts> png_texts(Front front) {
  Texts texts;
  while (true) {
    const auto head = front.take(8);
    if (!head) {
      return cut();
    }
    const std::string_view type = head->substr(4);
    if (type == "IDAT" || type == "IEND") {
      return texts;
    }
    const auto data = front.take(u32_big(std::as_bytes(std::span(*head)), 0));
    if (!data || !front.take(4)) {
      return cut();
    }
    const std::size_t zero = data->find('\0');
    if (type == "tEXt" && zero != std::string_view::npos) {
      texts[std::string(data->substr(0, zero))] = std::string(data->substr(zero + 1));
    }
  }
}

Result<Texts> exr_texts(Front front) {
  Texts texts;
  if (!front.take(4)) {
    return cut();
  }
  while (true) {
    const auto name = front.take_word();
    if (name && name->empty()) {
      return texts;
    }
    const auto type = name ? front.take_word() : name;
    const auto size = type ? front.take(4) : type;
    if (!size) {
      return cut();
    }
    const auto value = front.take(u32_little(std::as_bytes(std::span(*size)), 0));
    if (!value) {
      return cut();
    }
    if (*type == "string") {
      texts[std::string(*name)] = std::string(*value);
    }
  }
}

}  // namespace

Result<Texts> read_image_texts(std::span<const std::byte> start) {
  Front front({reinterpret_cast<const char*>(start.data()), start.size()});
  Front other = front;
  if (front.take(kPngMagic.size()) == kPngMagic) {
    return png_texts(front);
  }
  if (other.take(kExrMagic.size()) == kExrMagic) {
    return exr_texts(other);
  }
  return Error{ErrorCode::kInvalidArgument, "the body is neither a PNG nor an EXR image", ""};
}

}  // namespace core
