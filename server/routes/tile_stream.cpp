#include "server/routes/tile_stream.h"

#include <algorithm>
#include <chrono>
#include <span>
#include <utility>

#include "core/error/error_estimate.h"
#include "core/error/pixel_error.h"
#include "core/film/set_aside.h"
#include "core/settings/choices.h"

namespace server {
namespace {

using Clock = std::chrono::steady_clock;

/// Size of the pieces in which frames are passed to the HTTP server, at least: a record of TLS. A
/// client that does not read keeps one in memory.
constexpr std::size_t kPieceBytes = 16U << 10U;
constexpr std::chrono::milliseconds kTilePoll{1000};
constexpr std::chrono::microseconds kPace{20'000};
/// Marks frames without fireflies in the cache; not a flag of frames.
constexpr std::uint32_t kCalmFrame = 1U << 31U;

}  // namespace

api::TileFrame tile_frame(const core::TileState& state, int replicates, std::uint32_t flags) {
  const auto r = static_cast<std::size_t>(replicates);
  const std::size_t count = state.pixels.size() / r;
  api::TileFrame frame;
  frame.rect = state.rect;
  frame.flags = flags;
  const std::size_t planes = api::plane_count(flags);
  frame.planes.resize(count * planes);
  const auto plane = [&](std::size_t p, std::size_t pixel) -> float& {
    return frame.planes[p * count + pixel];
  };
  for (std::size_t i = 0; i < count; ++i) {
    const auto pixel = std::span(state.pixels).subspan(i * r, r);
    const core::HalfValue a = core::half_value(pixel, 0);
    const core::HalfValue b = core::half_value(pixel, 1);
    const core::HalfValue value = core::pixel_value(a, b);
    for (int c = 0; c < 3; ++c) {
      plane(static_cast<std::size_t>(c), i) = value.mean[c];
    }
    if ((flags & api::kTileAlpha) != 0) {
      plane(planes - 1, i) = value.alpha;
    }
    if ((flags & api::kTileMean) != 0) {
      continue;
    }
    const core::Rgb variance = core::raw_variance(a, b);
    for (int c = 0; c < 3; ++c) {
      plane(static_cast<std::size_t>(c) + 3, i) = variance[c];
    }
    plane(6, i) = static_cast<float>(value.count);
  }
  return frame;
}

api::TileFrame denoised_frame(const core::DenoisedPicture& picture, core::DenoiseMode mode,
                              const core::PixelRect& tile) {
  api::TileFrame frame;
  frame.rect = tile;
  frame.revision = picture.revision;
  frame.flags = api::kTileDenoised;
  std::vector<const core::Plane*> planes;
  for (const core::Plane& plane : picture.planes(mode)) {
    planes.push_back(&plane);
  }
  if (!picture.alpha(mode).empty()) {
    frame.flags |= api::kTileAlpha;
    planes.push_back(&picture.alpha(mode));
  }
  for (const core::Plane* plane : planes) {
    for (int y = tile.y - picture.rect.y; y < tile.y - picture.rect.y + tile.height; ++y) {
      const auto row =
          plane->begin() + std::ptrdiff_t{y} * picture.rect.width + (tile.x - picture.rect.x);
      frame.planes.insert(frame.planes.end(), row, row + tile.width);
    }
  }
  return frame;
}

TileStream::TileStream(const Parts& parts, JobPointer job, const api::TilesQuery& query)
    : parts_(parts), job_(std::move(job)), query_(query) {}

void TileStream::run(StreamWriter& writer) {
  while (!writer.client_gone() && !writer.stopping()) {
    // In this order, events after this number are seen in the next pass.
    const std::uint64_t seq = job_->log().last_seq();
    const bool is_final = job_->is_at_rest();
    const auto film = parts_.jobs.films().film(*job_);
    if (film &&
        !(send_new_tiles(writer, **film, is_final) && send_denoised(writer, **film, is_final))) {
      return;
    }
    // A film that cannot be read now is asked for again.
    const bool may_come = !film && film.error().code == core::ErrorCode::kUnavailable;
    if (is_final && !may_come) {
      const api::JobView view = parts_.jobs.view(*job_);
      writer.write(api::encode_end_frame(film ? (*film)->revision() : view.progress.revision,
                                         static_cast<float>(view.progress.error.relative)));
      return;
    }
    const auto now = Clock::now();
    job_->log().wait_after(seq, EventLog::Wake::kAnything, now + kTilePoll, writer.stop_token());
    const std::uint64_t news = job_->log().last_seq();
    job_->log().wait_after(news, EventLog::Wake::kDurable,
                           Clock::now() + parts_.streams.pace(kPace), writer.stop_token());
  }
}

bool TileStream::send_new_tiles(StreamWriter& writer, const core::Film& film, bool is_final) {
  const auto tiles = static_cast<std::size_t>(film.tile_count());
  sent_.resize(tiles, query_.after);
  const std::uint32_t flags =
      (core::is_transparent(job_->record().view.spec.render) ? api::kTileAlpha : 0U) |
      (query_.planes == api::TilePlanes::kMean ? api::kTileMean : 0U);
  const bool sets_aside = query_.fireflies == api::Fireflies::kSetAside;
  piece_.clear();
  for (std::size_t t = 0; t < tiles; ++t) {
    const int tile = static_cast<int>(t);
    const std::uint32_t revision = film.tile_revision(tile);
    if (revision <= sent_[t] || film.tile_samples(tile) == 0) {
      continue;
    }
    const auto make = [&] {
      api::TileFrame frame =
          tile_frame(sets_aside ? core::calm_tile(film, tile) : *film.shown_tile(tile),
                     film.replicates(), flags);
      if (film.errors() == core::PixelErrors::kCorrelated) {
        frame.flags |= api::kTileCorrelated;
      }
      frame.revision = revision;
      frame.relative_error = core::tile_error(film, tile);
      return frame;
    };
    // The error of a tile is relative to the whole image, so its frame changes with other tiles.
    // While they change it is as of its first encoding; afterwards it is exact.
    if (is_final) {
      piece_ += api::encode_tile_frame(make());
    } else {
      piece_ += *parts_.frames.get({.job = job_->sequence(),
                                    .tile = tile,
                                    .revision = revision,
                                    .flags = flags | (sets_aside ? kCalmFrame : 0U)},
                                   make);
    }
    sent_[t] = revision;
    if (piece_.size() >= kPieceBytes) {
      if (!writer.write(piece_)) {
        return false;
      }
      piece_.clear();
    }
  }
  return piece_.empty() || writer.write(piece_);
}

bool TileStream::send_denoised(StreamWriter& writer, const core::Film& film, bool is_final) {
  if (query_.denoise == api::DenoiseShow::kOff) {
    return true;
  }
  // Only the last picture waits for memory; others are retried in the next pass.
  const auto made =
      parts_.denoising.get(job_, film, {query_.denoise},
                           is_final ? MemoryGate::kPatience : std::chrono::milliseconds(0));
  if (!made || (*made)->view.revision <= std::max(denoised_sent_, query_.after)) {
    return true;
  }
  denoised_sent_ = (*made)->view.revision;
  const auto mode =
      api::is_full(query_.denoise) ? core::DenoiseMode::kFull : core::DenoiseMode::kMixed;
  const core::DenoisedPicture& picture = (*made)->picture;
  const auto tiles = core::tile_rects(picture.rect);
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    api::TileFrame frame = denoised_frame(picture, mode, tiles[t]);
    frame.flags |= query_.planes == api::TilePlanes::kMean ? api::kTileMean : 0U;
    frame.relative_error = static_cast<float>(picture.tile_error(mode, t));
    if (!writer.write(api::encode_tile_frame(frame))) {
      return false;
    }
  }
  return true;
}

}  // namespace server
