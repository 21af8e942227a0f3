#include "api/tile_frame.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

#include <immintrin.h>
#include <zlib.h>

#include "core/base/check.h"

namespace api {
namespace {

constexpr std::array<unsigned char, 4> kMagic = {'T', 'S', 'R', '1'};
constexpr int kSideMax = 65535;
constexpr float kHalfMax = 65504;  // of float16

// Writes and reads byte by byte, so that the order is the same on every machine.
void put(std::string& out, std::uint64_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) {
    out += static_cast<char>((value >> (8 * i)) & 0xFFU);
  }
}
void put_u16(std::string& out, int value) {
  CHECK(value >= 0 && value <= kSideMax);
  put(out, static_cast<std::uint64_t>(value), 2);
}
void put_f32(std::string& out, float value) { put(out, std::bit_cast<std::uint32_t>(value), 4); }

std::uint32_t take(std::span<const std::byte> bytes, std::size_t at, std::size_t count) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < count; ++i) {
    value |= std::to_integer<std::uint32_t>(bytes[at + i]) << (8 * i);
  }
  return value;
}

std::uint32_t checksum(const void* data, std::size_t size) {
  return static_cast<std::uint32_t>(
      crc32_z(crc32_z(0, nullptr, 0), static_cast<const Bytef*>(data), size));
}

void put_f16(std::string& out, float value) {
  put(out, _cvtss_sh(std::clamp(value, -kHalfMax, kHalfMax), _MM_FROUND_TO_NEAREST_INT), 2);
}
float f16(std::uint32_t bits) { return _cvtsh_ss(static_cast<unsigned short>(bits)); }

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
  const std::size_t bytes_each = value_bytes(frame.flags);
  std::string payload;
  payload.reserve(frame.planes.size() * bytes_each);
  for (const float value : frame.planes) {
    if (bytes_each == 2) {
      put_f16(payload, value);
    } else {
      put_f32(payload, value);
    }
  }
  std::string out;
  out.reserve(kTileHeaderBytes + payload.size());
  for (const unsigned char byte : kMagic) {
    out += static_cast<char>(byte);
  }
  put(out, payload.size(), 4);
  put(out, frame.revision, 4);
  put_u16(out, frame.rect.x);
  put_u16(out, frame.rect.y);
  put_u16(out, frame.rect.width);
  put_u16(out, frame.rect.height);
  put(out, frame.flags, 4);
  put_f32(out, frame.relative_error);
  put(out, checksum(payload.data(), payload.size()), 4);
  return out + payload;
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
  const std::size_t payload_bytes = take(bytes, 4, 4);
  TileFrame& frame = decoded.frame;
  frame.revision = take(bytes, 8, 4);
  frame.rect = {static_cast<int>(take(bytes, 12, 2)), static_cast<int>(take(bytes, 14, 2)),
                static_cast<int>(take(bytes, 16, 2)), static_cast<int>(take(bytes, 18, 2))};
  frame.flags = take(bytes, 20, 4);
  frame.relative_error = std::bit_cast<float>(take(bytes, 24, 4));
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
  if (checksum(payload.data(), payload.size()) != take(bytes, 28, 4)) {
    return broken("The checksum of the frame's payload is wrong.");
  }
  frame.planes.resize(payload_bytes / bytes_each);
  for (std::size_t i = 0; i < frame.planes.size(); ++i) {
    const std::uint32_t bits = take(payload, i * bytes_each, bytes_each);
    frame.planes[i] = bytes_each == 2 ? f16(bits) : std::bit_cast<float>(bits);
  }
  decoded.consumed = kTileHeaderBytes + payload_bytes;
  return decoded;
}

}  // namespace api
