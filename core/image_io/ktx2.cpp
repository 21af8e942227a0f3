#include "core/image_io/ktx2.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <zstd.h>

#include "core/base/byte_order.h"
#include "core/image_io/etc1s.h"
#include "core/image_io/image_codec.h"
#include "core/image_io/uastc.h"

namespace core {
namespace {

using Span = std::span<const std::byte>;

Error invalid(std::string_view message) {
  return {ErrorCode::kInvalidArgument, std::string("ktx2: ").append(message), ""};
}

/// KTX specification, section 3.
constexpr std::size_t kHeaderBytes = 80;
constexpr std::size_t kLevelBytes = 24;
constexpr std::uint32_t kLevelsMax = 32;
enum class Packing : std::uint8_t { kNone = 0, kBasisLz = 1, kZstd = 2 };
/// Data Format specification: 5.6.1, and channels of 5.6.13 and 5.6.14.
enum class Model : std::uint8_t { kEtc1s = 163, kUastc = 166 };
constexpr std::uint32_t kEtc1sGreen = 4;
constexpr std::uint32_t kEtc1sAlpha = 15;
constexpr std::uint32_t kUastcRgba = 3;
constexpr std::uint32_t kUastcRedGreen = 5;   ///< stored as RRRG
constexpr std::size_t kDescriptorBytes = 28;  ///< its own size, without samples
constexpr std::size_t kSampleBytes = 16;

/// Returns a part of the file; empty if it is out of range.
std::optional<Span> part(Span whole, std::uint64_t offset, std::uint64_t bytes) {
  if (offset > whole.size() || bytes > whole.size() - offset) {
    return std::nullopt;
  }
  return whole.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(bytes));
}

struct Ktx2 {
  Image image;  ///< without pixels
  Model model = Model::kUastc;
  Packing packing = Packing::kNone;
  bool has_second = false;      ///< a slice for alpha or green
  bool alpha_is_green = false;  ///< UASTC with RRRG
  Span level;
  Span global;
  std::uint32_t images = 0;  ///< in all levels
};

/// Reads the data format descriptor: the codec and its channels.
Status read_descriptor(Span descriptor, Ktx2& to) {
  if (descriptor.size() < kDescriptorBytes + kSampleBytes) {
    return invalid("the data format descriptor is truncated");
  }
  const std::uint32_t model = u32_little(descriptor, 12) & 255U;
  const auto channel = [&](std::size_t sample) {
    return u32_little(descriptor, kDescriptorBytes + sample * kSampleBytes) >> 24U & 15U;
  };
  const bool two = descriptor.size() >= kDescriptorBytes + 2 * kSampleBytes;
  if (model == static_cast<std::uint32_t>(Model::kEtc1s)) {
    to.model = Model::kEtc1s;
    to.has_second = two;
    if (two && channel(1) != kEtc1sAlpha && channel(1) != kEtc1sGreen) {
      return invalid("the second channel is neither alpha nor green");
    }
    to.image.channels = two && channel(1) == kEtc1sAlpha ? 4 : 3;
    return ok_status();
  }
  if (model == static_cast<std::uint32_t>(Model::kUastc)) {
    to.model = Model::kUastc;
    to.alpha_is_green = channel(0) == kUastcRedGreen;
    to.image.channels = channel(0) == kUastcRgba ? 4 : 3;
    return ok_status();
  }
  return invalid("its pixels are neither ETC1S nor UASTC, which is what glTF allows");
}

/// Checks that codec and supercompression are compatible.
Status check_packing(std::uint32_t scheme, Ktx2& to) {
  const bool known = scheme <= static_cast<std::uint32_t>(Packing::kZstd);
  to.packing = known ? static_cast<Packing>(scheme) : Packing::kNone;
  if (!known || (to.packing == Packing::kBasisLz) != (to.model == Model::kEtc1s)) {
    return invalid(to.model == Model::kEtc1s
                       ? "ETC1S must be compressed with BasisLZ"
                       : "UASTC must be compressed with Zstandard or not at all");
  }
  return ok_status();
}

Result<Ktx2> read_container(Span file, const ImageLimits& limits) {
  if (file.size() < kHeaderBytes + kLevelBytes) {
    return invalid("the header is truncated");
  }
  const std::uint32_t width = u32_little(file, 20);
  const std::uint32_t height = u32_little(file, 24);
  if (width == 0 || height == 0 || u32_little(file, 28) != 0 || u32_little(file, 32) != 0 ||
      u32_little(file, 36) != 1) {
    return invalid("it is not a single 2D image without layers and faces");
  }
  const std::uint32_t levels = std::max(u32_little(file, 40), 1U);
  if (u32_little(file, 12) != 0 || levels > kLevelsMax ||
      file.size() < kHeaderBytes + kLevelBytes * levels) {
    return invalid("its format is not allowed for glTF textures, or its levels are truncated");
  }
  Ktx2 ktx;
  const auto descriptor = part(file, u32_little(file, 48), u32_little(file, 52));
  const auto global = part(file, u64_little(file, 64), u64_little(file, 72));
  const auto level = part(file, u64_little(file, kHeaderBytes), u64_little(file, kHeaderBytes + 8));
  if (!descriptor || !global || !level) {
    return invalid("a part is outside the file");
  }
  if (auto status = read_descriptor(*descriptor, ktx); !status) {
    return status.error();
  }
  if (auto status = check_packing(u32_little(file, 44), ktx); !status) {
    return status.error();
  }
  const auto pixel_bytes = static_cast<std::uint64_t>(ktx.image.channels);
  if (auto fits = check_image_size(width, height, pixel_bytes, limits); !fits) {
    return fits.error();
  }
  ktx.image.width = static_cast<int>(width);
  ktx.image.height = static_cast<int>(height);
  ktx.level = *level;
  ktx.global = *global;
  ktx.images = levels;
  return ktx;
}

Status decode_etc1s(const Ktx2& ktx, Image& image) {
  // BasisLZ Global Data: six counts and lengths, then a descriptor of five numbers for each image.
  constexpr std::size_t kGlobalBytes = 20;
  constexpr std::size_t kImageBytes = 20;
  const Span global = ktx.global;
  if (global.size() < kGlobalBytes + kImageBytes * ktx.images) {
    return invalid("the global data of BasisLZ is truncated");
  }
  const std::uint64_t endpoints_at = kGlobalBytes + kImageBytes * ktx.images;
  const std::uint64_t selectors_at = endpoints_at + u32_little(global, 4);
  const std::uint64_t tables_at = selectors_at + u32_little(global, 8);
  const auto endpoints = part(global, endpoints_at, u32_little(global, 4));
  const auto selectors = part(global, selectors_at, u32_little(global, 8));
  const auto tables = part(global, tables_at, u32_little(global, 12));
  const auto color = part(ktx.level, u32_little(global, 24), u32_little(global, 28));
  const auto second = part(ktx.level, u32_little(global, 32), u32_little(global, 36));
  if (!endpoints || !selectors || !tables || !color || !second) {
    return invalid("a part of the BasisLZ data is outside the file");
  }
  if (u32_little(global, 20) != 0) {
    return invalid("it is a video frame");
  }
  const auto books = Etc1sCodebooks::read({.endpoint_count = u16_little(global, 0),
                                           .selector_count = u16_little(global, 2),
                                           .endpoints = *endpoints,
                                           .selectors = *selectors,
                                           .tables = *tables});
  if (!books) {
    return invalid("the codebooks of BasisLZ are malformed");
  }
  const auto channels = static_cast<std::size_t>(image.channels);
  Etc1sCodebooks::Target target = {.pixels = image.bytes,
                                   .width = static_cast<std::size_t>(image.width),
                                   .height = static_cast<std::size_t>(image.height),
                                   .channels = channels,
                                   .first = 0,
                                   .count = 3};
  bool is_whole = books->decode_slice(*color, target);
  if (is_whole && ktx.has_second) {
    target.first = channels == 4 ? 3 : 1;
    target.count = 1;
    is_whole = books->decode_slice(*second, target);
  }
  return is_whole ? ok_status() : Status(invalid("the blocks of BasisLZ are malformed"));
}

/// Returns the blocks of UASTC, decompressed into `space` if they are compressed.
Result<Span> uastc_blocks(const Ktx2& ktx, std::size_t bytes, std::vector<std::byte>& space) {
  if (ktx.packing == Packing::kNone) {
    return ktx.level.size() == bytes ? Result<Span>(ktx.level)
                                     : invalid("the number of bytes does not match the image size");
  }
  space.resize(bytes);
  const std::size_t found =
      ZSTD_decompress(space.data(), space.size(), ktx.level.data(), ktx.level.size());
  if (ZSTD_isError(found) != 0 || found != bytes) {
    return invalid("the Zstandard data is malformed or does not match the image size");
  }
  return Span(space);
}

Status decode_uastc(const Ktx2& ktx, Image& image) {
  const auto width = static_cast<std::size_t>(image.width);
  const auto height = static_cast<std::size_t>(image.height);
  const auto channels = static_cast<std::size_t>(image.channels);
  const std::size_t columns = (width + 3) / 4;
  std::vector<std::byte> space;
  const auto blocks = uastc_blocks(ktx, columns * ((height + 3) / 4) * kUastcBlockBytes, space);
  if (!blocks) {
    return blocks.error();
  }
  for (std::size_t block = 0; block < blocks->size() / kUastcBlockBytes; ++block) {
    const auto texels =
        decode_uastc_block(blocks->subspan(block * kUastcBlockBytes).first<kUastcBlockBytes>());
    if (!texels) {
      return invalid("a block of UASTC is malformed");
    }
    const std::size_t x = block % columns * 4;
    const std::size_t y = block / columns * 4;
    for (std::size_t i = 0; i < texels->size(); ++i) {
      if (x + i % 4 >= width || y + i / 4 >= height) {
        continue;
      }
      const std::size_t at = ((y + i / 4) * width + x + i % 4) * channels;
      for (std::size_t c = 0; c < channels; ++c) {
        image.bytes[at + c] =
            static_cast<std::byte>((*texels)[i][ktx.alpha_is_green && c == 1 ? 3 : c]);
      }
    }
  }
  return ok_status();
}

/// Clears blue in an image of two channels.
void clear_blue(Image& image) {
  for (std::size_t i = 2; i < image.bytes.size(); i += 3) {
    image.bytes[i] = std::byte{0};
  }
}

}  // namespace

Result<Image> read_ktx2_header(Span file, const ImageLimits& limits) {
  auto ktx = read_container(file, limits);
  if (!ktx) {
    return ktx.error();
  }
  return std::move(ktx->image);
}

Result<Image> decode_ktx2(Span file, const ImageLimits& limits) {
  const auto ktx = read_container(file, limits);
  if (!ktx) {
    return ktx.error();
  }
  Image image = ktx->image;
  image.bytes.resize(image.value_count());
  if (auto status =
          ktx->model == Model::kEtc1s ? decode_etc1s(*ktx, image) : decode_uastc(*ktx, image);
      !status) {
    return status.error();
  }
  if (image.channels == 3 && (ktx->has_second || ktx->alpha_is_green)) {
    clear_blue(image);
  }
  return image;
}

}  // namespace core
