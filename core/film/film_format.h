/// Portable film files: application/vnd.tessera.film, version 1, little endian.
///
// clang-format off
/// Head, 128 bytes: offset and content
///    0  "TSRFILM1"
///    8  u32 bytes of head, ledger and text
///   12  u32 bytes of the text
///   16  u32 ranges
///   20  u32 flags
///   24  i32 width, height of the full film
///   32  i32 crop x, y, width, height
///   48  u32 replicates
///   52  u32 tiles
///   56  u64 bytes of the file
///   64  sha256 of the content (Film::digest), hex
///
/// Flags: 1 auxiliary values, 2 errors of neighbouring pixels are correlated, 4 splats,
/// 8 depths along the camera's axis, 16 mattes of objects, 32 of materials, 64 errors are of the
/// image over white, 128 first hits; from bit 8 on the number of shares of the image's light,
/// whose layers the text names. api/operations.cpp publishes this layout.
///
/// Ledger, 24 bytes per range:
///   u64 seed, u32 first replicate, u32 replicates, u32 samples, u32 0
///
/// Text: the caller's description of the film (UTF-8), then zeros up to a multiple of 8.
///
/// With flag 4: u64 light paths of each replicate, u64 rejected splats, u64 rays of light paths.
///
/// Tiles, row by row, 32x32 anchored at the full film's origin and clipped to the crop:
///   i32 x, i32 y, u32 samples, u32 0, u64 rejected samples, u64 rays, f64 CPU seconds (with an
///   equal share of the time for other work); then
///             each pixel and replicate      f32 mean r, g, b, alpha, M2 of luminance, u32 count
///   flag 1    each pixel                    f32 albedo r, g, b, normal x, y, z, depth, u32 hits
///   flag 4    each pixel and replicate,     i128 sums r, g, b of splats in units of 2^-40
///             then the same for each share
///   shares    each pixel, replicate, share  f32 mean r, g, b
///   flag 128  each pixel                    u32 object, instance, material, primitive,
///                                           f32 position x, y, z, u, v, motion x, y
///                                           (NaN: unknown)
///   16, 32    each pixel and flag           six times u32 id of Cryptomatte, u32 samples of half
///                                           A and B that hit it
///   flag 8    each pixel                    f32 depth along the camera's axis; 0: nothing
///
/// Last, 64 bytes: sha256 (hex) of everything before.
// clang-format on
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/film/film_merge.h"

namespace core {

inline constexpr std::size_t kFilmHeadBytes = 128;

struct FilmFormatLimits {
  int side_max = 16384;
  std::int64_t pixels_max = 64'000'000;
  int replicates_max = 64;
  int shares_max = 64;
  std::uint32_t text_bytes_max = std::uint32_t{1} << 20U;
  std::uint64_t file_bytes_max = std::uint64_t{4} << 30U;
};

/// Returns the size of the file that write_film() writes.
std::uint64_t film_file_bytes(const Film& film, const SampleLedger& ledger, std::size_t text_bytes);

/// Receives the file in pieces; returns false to stop writing.
using ByteSink = std::function<bool(std::span<const std::byte>)>;

/// Writes the film. Returns false if the sink stopped it. part.film must not change meanwhile.
bool write_film(const FilmPart& part, const std::string& text, const ByteSink& sink);

/// Checks the first kFilmHeadBytes against the limits and the length of the file, before the rest
/// is read. Errors: kInvalidArgument (not a film, truncated, another version, inconsistent sizes),
/// kTooLarge.
Status check_film_head(std::span<const std::byte> head, std::uint64_t file_bytes,
                       const FilmFormatLimits& limits);

struct FilmFileContent {
  FilmPart part;
  std::string text;  ///< as given to write_film(); not interpreted here
};
/// Returns the film's shares of the light as its text names them; empty if it names none.
using SharesOfText = std::function<std::vector<LightShare>(const std::string& text)>;
/// Reads a film and checks every value: sizes before allocation, both checksums, finite means,
/// counts against the ledger. Errors: as check_film_head().
Result<FilmFileContent> read_film(std::span<const std::byte> file, const FilmFormatLimits& limits,
                                  const SharesOfText& shares = nullptr);

}  // namespace core
