#include "core/image_io/webp.h"

#include <cstdint>
#include <memory>
#include <utility>

#include <webp/decode.h>
#include <webp/demux.h>

#include "core/image_io/image_codec.h"

namespace core {
namespace {

Error broken() { return {ErrorCode::kInvalidArgument, "the WebP is truncated or malformed", ""}; }

/// An open file and its first frame. Borrows the file.
class WebpFile {
 public:
  explicit WebpFile(std::span<const std::byte> file)
      : data_{reinterpret_cast<const std::uint8_t*>(file.data()), file.size()},
        demuxer_(WebPDemux(&data_), &WebPDemuxDelete) {}
  ~WebpFile() { WebPDemuxReleaseIterator(&frame_); }
  WebpFile(const WebpFile&) = delete;
  WebpFile& operator=(const WebpFile&) = delete;

  Result<Image> header(const ImageLimits& limits) {
    if (demuxer_ == nullptr || WebPDemuxGetFrame(demuxer_.get(), 1, &frame_) == 0) {
      return broken();
    }
    Image image;
    const std::uint32_t width = WebPDemuxGetI(demuxer_.get(), WEBP_FF_CANVAS_WIDTH);
    const std::uint32_t height = WebPDemuxGetI(demuxer_.get(), WEBP_FF_CANVAS_HEIGHT);
    const bool is_part = std::cmp_less(frame_.width, width) || std::cmp_less(frame_.height, height);
    const bool has_alpha =
        (WebPDemuxGetI(demuxer_.get(), WEBP_FF_FORMAT_FLAGS) & ALPHA_FLAG) != 0 || is_part;
    image.channels = has_alpha ? 4 : 3;
    if (auto fits =
            check_image_size(width, height, static_cast<std::uint64_t>(image.channels), limits);
        !fits) {
      return fits.error();
    }
    image.width = static_cast<int>(width);
    image.height = static_cast<int>(height);
    return image;
  }

  /// Pre: header() succeeded.
  Result<Image> pixels(Image image) const {
    image.bytes.assign(image.value_count(), std::byte{0});
    const int stride = image.width * image.channels;
    const std::size_t first =
        static_cast<std::size_t>(frame_.y_offset) * static_cast<std::size_t>(stride) +
        static_cast<std::size_t>(frame_.x_offset) * static_cast<std::size_t>(image.channels);
    if (frame_.x_offset + frame_.width > image.width ||
        frame_.y_offset + frame_.height > image.height) {
      return broken();
    }
    const auto decode = image.channels == 4 ? &WebPDecodeRGBAInto : &WebPDecodeRGBInto;
    auto* const to = reinterpret_cast<std::uint8_t*>(image.bytes.data()) + first;
    if (decode(frame_.fragment.bytes, frame_.fragment.size, to, image.bytes.size() - first,
               stride) == nullptr) {
      return broken();
    }
    return image;
  }

 private:
  WebPData data_;
  std::unique_ptr<WebPDemuxer, void (*)(WebPDemuxer*)> demuxer_;
  WebPIterator frame_ = {};
};

}  // namespace

Result<Image> read_webp_header(std::span<const std::byte> file, const ImageLimits& limits) {
  return WebpFile(file).header(limits);
}

Result<Image> decode_webp(std::span<const std::byte> file, const ImageLimits& limits) {
  WebpFile opened(file);
  auto image = opened.header(limits);
  return image ? opened.pixels(*std::move(image)) : image;
}

}  // namespace core
