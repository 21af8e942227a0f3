/// TileFrames: the encoded tiles that were sent last, so that the streams of a job encode each tile
/// once for all of them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "api/answers/tile_frame.h"
#include "server/scenes/single_flight_cache.h"

namespace server {

class TileFrames {
 public:
  /// What 64 threads commit between two polls of a stream: two commit 1.6 MB of frames in a second
  /// (tests/bench/run --api-load), and streams poll every 30 ms. Part of what the memory limit sets
  /// aside for the process.
  static constexpr std::uint64_t kBytes = std::uint64_t{4} << 20U;

  using Frame = std::shared_ptr<const std::string>;
  struct Key {
    std::int64_t job = 0;  ///< Job::sequence(): ids may be used again
    int tile = 0;
    std::uint32_t revision = 0;
    std::uint32_t flags = 0;  ///< of the request: kTileAlpha and kTileMean
  };
  /// Returns the frame; the first caller runs make() -> api::TileFrame. If that failed for lack of
  /// memory, the others make their own.
  template <typename Make>
  Frame get(const Key& of, const Make& make) {
    const std::string key = std::to_string(of.job) + '.' + std::to_string(of.tile) + '.' +
                            std::to_string(of.revision) + '.' + std::to_string(of.flags);
    const auto encode = [&] {
      return std::make_shared<const std::string>(api::encode_tile_frame(make()));
    };
    const auto frame = frames_.get(key, [&]() -> core::Result<Frames::Made> {
      Frame text = encode();
      const std::uint64_t bytes = text->size();
      return Frames::Made{.value = std::move(text), .bytes = bytes};
    });
    return frame ? *frame : encode();
  }

  std::uint64_t bytes() const { return frames_.bytes(); }

 private:
  using Frames = SingleFlightCache<std::string>;
  Frames frames_{kBytes};
};

}  // namespace server
