#include "clients/cli/tile_frames.h"

#include <bit>
#include <cstddef>
#include <span>

#include <zlib.h>

#include "core/base/byte_order.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kPayloadMax = std::size_t{1} << 26U;
constexpr std::uint32_t kEnd = 1;
constexpr std::uint32_t kAlpha = 4;
constexpr std::size_t kAlphaPlane = 7;

Error broken(const char* why) {
  return Error{ErrorCode::kInvalidArgument, std::string("the stream of tiles is invalid: ") + why,
               ""};
}

core::Result<TileFrame> read_frame(std::span<const std::byte> header,
                                   std::span<const std::byte> payload) {
  const std::uint32_t flags = core::u32_little(header, 20);
  TileFrame frame;
  frame.x = static_cast<int>(core::u16_little(header, 12));
  frame.y = static_cast<int>(core::u16_little(header, 14));
  frame.width = static_cast<int>(core::u16_little(header, 16));
  frame.height = static_cast<int>(core::u16_little(header, 18));
  frame.is_end = (flags & kEnd) != 0;
  frame.has_alpha = (flags & kAlpha) != 0;
  if (crc32(0, reinterpret_cast<const Bytef*>(payload.data()), static_cast<uInt>(payload.size())) !=
      core::u32_little(header, 28)) {
    return broken("a checksum is wrong");
  }
  if (frame.is_end) {
    return frame;
  }
  const std::size_t count =
      static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
  if (payload.size() != count * sizeof(float) * (frame.has_alpha ? kAlphaPlane + 1 : kAlphaPlane)) {
    return broken("a tile does not have its stated size");
  }
  const auto add_planes = [&](std::size_t first, std::size_t planes) {
    for (std::size_t i = first * count; i < (first + planes) * count; ++i) {
      frame.planes.push_back(std::bit_cast<float>(core::u32_little(payload, i * sizeof(float))));
    }
  };
  frame.planes.reserve(4 * count);
  add_planes(0, 3);
  add_planes(kAlphaPlane, frame.has_alpha ? 1 : 0);
  return frame;
}

}  // namespace

core::Result<std::vector<TileFrame>> TileParser::feed(std::string_view piece) {
  pending_ += piece;
  std::vector<TileFrame> frames;
  std::size_t at = 0;
  while (pending_.size() - at >= kHeaderBytes) {
    const auto rest = std::as_bytes(std::span(pending_)).subspan(at);
    const std::size_t size = core::u32_little(rest, 4);
    if (pending_.compare(at, 4, "TSR1") != 0 || size > kPayloadMax) {
      return broken("a tile does not begin as expected");
    }
    if (rest.size() < kHeaderBytes + size) {
      break;
    }
    auto frame = read_frame(rest.first(kHeaderBytes), rest.subspan(kHeaderBytes, size));
    if (!frame) {
      return frame.error();
    }
    frames.push_back(*std::move(frame));
    at += kHeaderBytes + size;
  }
  pending_.erase(0, at);
  return frames;
}

}  // namespace cli
