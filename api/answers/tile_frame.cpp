#include "api/answers/tile_frame.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include <zlib.h>

#include "core/base/check.h"
#include "core/math/intrinsics.h"
#include "core/math/numbers.h"

namespace api {
namespace {

constexpr std::array<unsigned char, 4> kMagic = {'T', 'S', 'R', '1'};
constexpr int kSideMax = 65535;

struct Header {
  std::array<unsigned char, 4> magic;
  std::uint32_t payload_bytes, revision;
  std::uint16_t x, y, width, height;
  std::uint32_t flags;
  float relative_error;
  std::uint32_t checksum;
};
static_assert(sizeof(Header) == kTileHeaderBytes);
static_assert(std::endian::native == std::endian::little);  // as in the frames

std::uint32_t checksum(const void* data, std::size_t size) {
  return static_cast<std::uint32_t>(
      crc32_z(crc32_z(0, nullptr, 0), static_cast<const Bytef*>(data), size));
}

/// Writes values as float16, at most core::kHalfMax.
void put_f16(std::span<const float> values, char* out) {
  const __m256 most = _mm256_set1_ps(core::kHalfMax);
  const __m256 least = _mm256_set1_ps(-core::kHalfMax);
  for (std::size_t i = 0; i < values.size(); i += 8) {
    const std::size_t count = std::min<std::size_t>(8, values.size() - i);
    alignas(32) float eight[8] = {};
    std::memcpy(eight, values.data() + i, count * sizeof(float));
    // The second operand comes out where one is NaN.
    const __m256 bounded = _mm256_min_ps(most, _mm256_max_ps(least, _mm256_load_ps(eight)));
    const __m128i halves = _mm256_cvtps_ph(bounded, _MM_FROUND_TO_NEAREST_INT);
    std::memcpy(out + 2 * i, &halves, count * sizeof(std::uint16_t));
  }
}

std::size_t value_count(const core::PixelRect& rect, std::uint32_t flags) {
  return plane_count(flags) * static_cast<std::size_t>(rect.width) *
         static_cast<std::size_t>(rect.height);
}
std::size_t value_bytes(std::uint32_t flags) { return (flags & kTileMean) != 0 ? 2 : 4; }

core::Error broken(std::string message) {
  return {core::ErrorCode::kInvalidArgument, std::move(message), ""};
}

}  // namespace

std::size_t plane_count(std::uint32_t flags) {
  if ((flags & kTileEnd) != 0) {
    return 0;
  }
  return ((flags & (kTileMean | kTileDenoised)) != 0 ? 3U : 7U) +
         ((flags & kTileAlpha) != 0 ? 1U : 0U);
}

std::string encode_tile_frame(const TileFrame& frame) {
  CHECK(frame.planes.size() == value_count(frame.rect, frame.flags));
  for (const int number : {frame.rect.x, frame.rect.y, frame.rect.width, frame.rect.height}) {
    CHECK(number >= 0 && number <= kSideMax);
  }
  const std::size_t payload_bytes = frame.planes.size() * value_bytes(frame.flags);
  std::string out(kTileHeaderBytes + payload_bytes, '\0');
  char* payload = out.data() + kTileHeaderBytes;
  if (value_bytes(frame.flags) == 2) {
    put_f16(frame.planes, payload);
  } else if (payload_bytes > 0) {
    std::memcpy(payload, frame.planes.data(), payload_bytes);
  }
  const Header header = {.magic = kMagic,
                         .payload_bytes = static_cast<std::uint32_t>(payload_bytes),
                         .revision = frame.revision,
                         .x = static_cast<std::uint16_t>(frame.rect.x),
                         .y = static_cast<std::uint16_t>(frame.rect.y),
                         .width = static_cast<std::uint16_t>(frame.rect.width),
                         .height = static_cast<std::uint16_t>(frame.rect.height),
                         .flags = frame.flags,
                         .relative_error = frame.relative_error,
                         .checksum = checksum(payload, payload_bytes)};
  std::memcpy(out.data(), &header, sizeof(header));
  return out;
}

std::string encode_end_frame(std::uint32_t revision, float relative_error) {
  TileFrame frame;
  frame.revision = revision;
  frame.flags = kTileEnd;
  frame.relative_error = relative_error;
  return encode_tile_frame(frame);
}

core::Result<DecodedFrame> decode_tile_frame(std::span<const std::byte> bytes) {
  for (std::size_t i = 0; i < kMagic.size() && i < bytes.size(); ++i) {
    if (std::to_integer<unsigned char>(bytes[i]) != kMagic[i]) {
      return broken("The frame does not begin with T S R 1.");
    }
  }
  DecodedFrame decoded;
  if (bytes.size() < kTileHeaderBytes) {
    return decoded;
  }
  Header header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  const std::size_t payload_bytes = header.payload_bytes;
  TileFrame& frame = decoded.frame;
  frame.revision = header.revision;
  frame.rect = {header.x, header.y, header.width, header.height};
  frame.flags = header.flags;
  frame.relative_error = header.relative_error;
  const std::size_t bytes_each = value_bytes(frame.flags);
  const std::size_t expected = value_count(frame.rect, frame.flags) * bytes_each;
  if (payload_bytes != expected) {
    return broken("The frame has " + std::to_string(payload_bytes) +
                  " bytes of payload; its size and flags require " + std::to_string(expected) +
                  ".");
  }
  if (bytes.size() - kTileHeaderBytes < payload_bytes) {
    return DecodedFrame{};
  }
  const std::span<const std::byte> payload = bytes.subspan(kTileHeaderBytes, payload_bytes);
  if (checksum(payload.data(), payload.size()) != header.checksum) {
    return broken("The checksum of the frame's payload is wrong.");
  }
  frame.planes.resize(payload_bytes / bytes_each);
  if (bytes_each == 2) {
    for (std::size_t i = 0; i < frame.planes.size(); ++i) {
      unsigned short half = 0;
      std::memcpy(&half, payload.data() + 2 * i, sizeof(half));
      frame.planes[i] = _mm_cvtss_f32(_mm_cvtph_ps(_mm_cvtsi32_si128(half)));
    }
  } else if (payload_bytes > 0) {
    std::memcpy(frame.planes.data(), payload.data(), payload_bytes);
  }
  decoded.consumed = kTileHeaderBytes + payload_bytes;
  return decoded;
}

}  // namespace api
