/// Binary tile frames, application/vnd.tessera.tiles.
///
/// Little endian: `T S R 1`, u32 payload bytes, u32 revision, u16 x, y, width, height, u32 flags,
/// f32 relative error, u32 CRC-32 (zlib's) of the payload: 32 bytes. Payload: planes of float32,
/// row by row: mean r g b, variance of the mean vr vg vb, sample count n, and alpha if flagged.
/// With kTileMean, float16 instead: only mean r g b, and alpha if flagged, at most 65504. For
/// denoised pictures: r g b and, if flagged, alpha, as float32 or, if flagged, float16.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/settings/settings.h"

namespace api {

inline constexpr std::size_t kTileHeaderBytes = 32;
inline constexpr std::uint32_t kTileEnd = 1U << 0U;  ///< end frame, no payload
inline constexpr std::uint32_t kTileCorrelated =
    1U << 1U;                                          ///< variances must not be added over a block
inline constexpr std::uint32_t kTileAlpha = 1U << 2U;  ///< the last plane is alpha
inline constexpr std::uint32_t kTileMean = 1U << 3U;   ///< means only, as float16
inline constexpr std::uint32_t kTileDenoised = 1U << 4U;  ///< of a denoised picture

/// Returns the number of planes of a frame with these flags.
std::size_t plane_count(std::uint32_t flags);

struct TileFrame {
  core::PixelRect rect;  ///< pixels of the full film; each number below 65536
  std::uint32_t revision = 0;
  std::uint32_t flags = 0;
  float relative_error = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> planes;  ///< plane_count() times width * height
};

/// Pre: planes has the size required by flags and rect.
std::string encode_tile_frame(const TileFrame& frame);
/// Returns the frame that ends a stream; revision: the job's last one.
std::string encode_end_frame(std::uint32_t revision, float relative_error);

/// Decodes a frame at the beginning of `bytes` and returns its size; consumed 0: it is incomplete.
/// Errors: kInvalidArgument (magic, inconsistent sizes, checksum), with the reason.
struct DecodedFrame {
  std::size_t consumed = 0;
  TileFrame frame;
};
core::Result<DecodedFrame> decode_tile_frame(std::span<const std::byte> bytes);

}  // namespace api
